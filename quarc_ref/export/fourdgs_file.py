"""Frames as a `.4dgs` file of keyframes and deltas, by the library fourdgs.

The temporal model `keyframe-delta` has no harmonics beyond the base color: the
view-dependent part of colors is left out. Errors are bounded by the library's
profile `fine`.
"""

from typing import Any

import numpy as np

from quarc_ref.export.activate import base_colors_of, opacities_of, scales_of, xyzw_of
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.errors import ExportError

_NEVER_FADES = 1e9  # seconds; this temporal model takes no infinity


class Sequence:
    """One file for all frames; its time begins with the first of them.

    Args:
        clip: What holds for all frames.
    """

    def __init__(self, clip: Clip) -> None:
        self._clip = clip
        self._samples: list[Any] = []
        self._first = 0
        self._end = 0.0

    def add(self, frame: Frame) -> None:
        """Append a frame."""
        if not self._samples:
            self._first = frame.scene.frame
        begin = self._clip.seconds(frame.scene.frame - self._first)
        self._end = self._clip.seconds(frame.scene.frame - self._first + 1)
        self._samples.append(make_sample(frame, begin))

    def finish(self) -> bytes:
        """Return the bytes of the file.

        Raises:
            ExportError: The library refuses the frames.
        """
        from fourdgs.exceptions import FourdgsError
        from fourdgs.keyframe_delta_file import write_sequence

        try:
            data: bytes = write_sequence(
                self._samples, self._end, profile="fine", library="quarc-ref"
            )
        except FourdgsError as error:
            message = f"fourdgs makes no file of the frames: {error}"
            raise ExportError(message) from error
        return data


def make_sample(frame: Frame, seconds: float) -> Any:  # noqa: ANN401
    """Return a frame as the library has it, a `Sample`.

    Args:
        frame: A frame.
        seconds: When it begins.
    """
    from fourdgs import GaussianSet
    from fourdgs.keyframe_delta_writer import Sample

    splats, count = frame.splats, frame.scene.count
    opacities = opacities_of(splats)[:, None]
    gaussians = GaussianSet(
        positions=splats.positions,
        scales=scales_of(splats),
        rotations=xyzw_of(splats.rotations),
        colors=np.concatenate([base_colors_of(splats), opacities], axis=1),
        motions=np.zeros((count, 3), dtype=np.float32),
        mu_t=np.zeros(count),
        sigma_t=np.full(count, _NEVER_FADES),
        win_lo=np.zeros(count),
        win_hi=np.full(count, np.inf),
    )
    return Sample(seconds, frame.scene.ids, gaussians)
