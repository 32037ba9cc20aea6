"""Writes the decoded frames of a stream to the `4dgs` container with the package `fourdgs`.

The temporal model `keyframe-delta` of `4dgs` codes the first frame completely, and later frames by
the changes of each Gaussian. Of all models, it is the most similar to this format without anchors.
The model has no SH beyond the base color, which reduces the size. Error bounds are those of the
profile `default`.
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
    """Sizes of `4dgs` files in bytes.

    Attributes:
        settings: Description of the writer's settings.
        first: Size of a file of only the first frame.
        total: Size of the file of all frames.
    """

    settings: str
    first: int
    total: int


def count_bytes(scenes: Iterable[Scene]) -> list[Sizes]:
    """Return the sizes of `4dgs` files of the frames for several settings; the smallest is first.

    Args:
        scenes: All frames of a stream, in order.

    Raises:
        ImportError: `fourdgs` or `zstandard` is not installed.
    """
    import zstandard  # noqa: F401, the codec of `fewest_options` requires it
    from fourdgs.keyframe_delta_file import write_sequence
    from fourdgs.keyframe_delta_writer import KeyframeDeltaOptions
    from fourdgs.serialization import CODEC_ZSTD

    samples = list(_make_samples(scenes))
    frame_seconds = samples[1].t0 if len(samples) > 1 else 1.0
    fewest_options = {
        "kd": KeyframeDeltaOptions(keyframe_every=len(samples)),
        "codec": CODEC_ZSTD,
        "level": 19,
        "write_index": False,
    }

    def count_file_bytes(frames: list[Any], options: dict[str, Any]) -> int:
        return len(write_sequence(frames, frame_seconds * len(frames), **options))

    return [
        Sizes(settings, count_file_bytes(samples[:1], options), count_file_bytes(samples, options))
        for settings, options in ((FEWEST_BYTES, fewest_options), (PLAIN_SETTINGS, {}))
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
            rotations=np.roll(splats.rotations, -1, axis=1),  # its order is xyzw
            colors=np.concatenate([colors, opacities], axis=1),
            motions=np.zeros((count, 3), dtype=np.float32),
            mu_t=np.full(count, time),
            sigma_t=np.ones(count),
            win_lo=np.zeros(count),
            win_hi=np.full(count, np.inf),
        )
        yield Sample(time, scene.ids, gaussians)
