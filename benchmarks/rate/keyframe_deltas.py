"""Writes the decoded frames of a stream to `4dgs` files with the Python package `fourdgs`.

The temporal model `keyframe-delta` of `4dgs` codes the first frame completely, and later frames as
the changes of each Gaussian. Among the temporal models of `4dgs`, this one is most similar to the
format of this project, but it has no anchors. The files contain no SH beyond the base color, which
makes them smaller. Their error bounds are those of the `4dgs` profile `default`.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.constants import SH_C0

SMALLEST_SETTINGS = (
    "one keyframe, chained deltas, zstd level 19, no index; base color only, no higher SH"
)
DEFAULT_SETTINGS = (
    "a keyframe every 8 frames, chained deltas, deflate level 6, with an index; base color only, "
    "no higher SH"
)


@dataclass(frozen=True, slots=True)
class FileSizes:
    """Sizes of the `4dgs` files of a stream's frames in bytes.

    Attributes:
        settings: Description of the settings with which the files were written.
        first: Size of a file with only the first frame.
        total: Size of a file with all frames.
    """

    settings: str
    first: int
    total: int


def measure_file_sizes(scenes: Iterable[Scene]) -> list[FileSizes]:
    """Write `4dgs` files with several settings; return their sizes, smallest first.

    Args:
        scenes: All frames of a stream, in order.

    Raises:
        ImportError: `fourdgs` or `zstandard` is not installed.
    """
    import zstandard  # noqa: F401, the codec of `smallest_options` requires it
    from fourdgs.keyframe_delta_file import write_sequence
    from fourdgs.keyframe_delta_writer import KeyframeDeltaOptions
    from fourdgs.serialization import CODEC_ZSTD

    samples = list(_make_samples(scenes))
    frame_seconds = samples[1].t0 if len(samples) > 1 else 1.0
    smallest_options = {
        "kd": KeyframeDeltaOptions(keyframe_every=len(samples)),
        "codec": CODEC_ZSTD,
        "level": 19,
        "write_index": False,
    }

    def measure_file_size(frames: list[Any], options: dict[str, Any]) -> int:
        return len(write_sequence(frames, frame_seconds * len(frames), **options))

    return [
        FileSizes(
            settings, measure_file_size(samples[:1], options), measure_file_size(samples, options)
        )
        for settings, options in ((SMALLEST_SETTINGS, smallest_options), (DEFAULT_SETTINGS, {}))
    ]


def _make_samples(scenes: Iterable[Scene]) -> Iterator[Any]:
    from fourdgs import GaussianSet
    from fourdgs.keyframe_delta_writer import Sample

    for scene in scenes:
        splats, time = dequantize(scene), scene.frame / scene.header.frames_per_second
        count = scene.count
        opacities = 1 / (1 + np.exp(-splats.opacities[:, None]))
        colors = np.clip(0.5 + SH_C0 * splats.sh[:, 0], 0, 1)
        gaussians = GaussianSet(
            positions=splats.positions,
            scales=np.exp(splats.log_scales),
            rotations=np.roll(splats.rotations, -1, axis=1),  # fourdgs stores them as xyzw
            colors=np.concatenate([colors, opacities], axis=1),
            motions=np.zeros((count, 3), dtype=np.float32),
            mu_t=np.full(count, time),
            sigma_t=np.ones(count),
            win_lo=np.zeros(count),
            win_hi=np.full(count, np.inf),
        )
        yield Sample(time, scene.ids, gaussians)
