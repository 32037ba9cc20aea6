"""Writes the decoded frames of a stream to the `4dgs` container with the package `fourdgs`.

Its temporal model `keyframe-delta` codes the first frame completely, and every later one by the
changes of each Gaussian: the model most similar to this format without anchors. It has no SH beyond
the base color in this model, which reduces its size. Error bounds are those of its profile
`default`.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.scene import Scene

FEWEST_BYTES = "one keyframe, deltas chained, zstd 19, no index; no SH beyond the base color"
PLAIN_SETTINGS = "keyframe every 8, deltas chained, deflate 6, index; no SH beyond the base color"
_SH_BASE = 0.28209479177387814


@dataclass(frozen=True, slots=True)
class Sizes:
    """Bytes of a `4dgs` file.

    Attributes:
        settings: Settings that it is written with.
        first: Bytes of a file of only the first frame.
        total: Bytes of the file of all frames.
    """

    settings: str
    first: int
    total: int


def count_bytes(scenes: Iterable[Scene]) -> list[Sizes]:
    """Return the sizes of the frames in `4dgs` files, the smallest first.

    Args:
        scenes: All frames of a stream, in order.

    Raises:
        ImportError: The package, or `zstandard`, is not installed.
    """
    import zstandard  # noqa: F401, what its codec of fewest bytes needs
    from fourdgs.keyframe_delta_file import write_sequence
    from fourdgs.keyframe_delta_writer import KeyframeDeltaOptions
    from fourdgs.serialization import CODEC_ZSTD

    samples = list(_make_samples(scenes))
    pace = samples[1].t0 if len(samples) > 1 else 1.0
    fewest = {
        "kd": KeyframeDeltaOptions(keyframe_every=len(samples)),
        "codec": CODEC_ZSTD,
        "level": 19,
        "write_index": False,
    }

    def count(frames: list[Any], options: dict[str, Any]) -> int:
        return len(write_sequence(frames, pace * len(frames), **options))

    return [
        Sizes(settings, count(samples[:1], options), count(samples, options))
        for settings, options in ((FEWEST_BYTES, fewest), (PLAIN_SETTINGS, {}))
    ]


def _make_samples(scenes: Iterable[Scene]) -> Iterator[Any]:
    from fourdgs import GaussianSet
    from fourdgs.keyframe_delta_writer import Sample

    for scene in scenes:
        splats, time = dequantize(scene), scene.frame / scene.header.frames_per_second
        count = scene.count
        opacities = 1 / (1 + np.exp(-splats.opacities[:, None]))
        colors = np.clip(0.5 + _SH_BASE * splats.sh[:, 0], 0, 1)
        gaussians = GaussianSet(
            positions=splats.positions,
            scales=np.exp(splats.log_scales),
            rotations=np.roll(splats.rotations, -1, axis=1),  # it has xyzw
            colors=np.concatenate([colors, opacities], axis=1),
            motions=np.zeros((count, 3), dtype=np.float32),
            mu_t=np.full(count, time),
            sigma_t=np.ones(count),
            win_lo=np.zeros(count),
            win_hi=np.full(count, np.inf),
        )
        yield Sample(time, scene.ids, gaussians)
