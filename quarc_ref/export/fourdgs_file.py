"""Writes and reads `.4dgs` files by the library fourdgs.

Files are written with the temporal model `keyframe-delta`, which has no view-dependent
color, and with errors bounded by the library's profile `fine`.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Float32, Splats
from quarc_ref.export.activate import SH_BASE, base_colors_of, opacities_of, scales_of, xyzw_of
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.errors import ExportError
from quarc_ref.format.arrays import Int64

_NEVER_FADES = 1e9  # seconds; this temporal model does not accept infinity


class Sequence:
    """Collects all frames in one file, in which the first frame is at time 0.

    Args:
        clip: Properties of all frames.
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
        """Build the file.

        Raises:
            ExportError: The library rejects the frames.
        """
        from fourdgs.exceptions import FourdgsError
        from fourdgs.keyframe_delta_file import write_sequence

        try:
            data: bytes = write_sequence(
                self._samples, self._end, profile="fine", library="quarc-ref"
            )
        except FourdgsError as error:
            message = f"fourdgs cannot write the frames: {error}"
            raise ExportError(message) from error
        return data


def make_sample(frame: Frame, seconds: float) -> Any:  # noqa: ANN401
    """Convert a frame to the library's `Sample`.

    Args:
        frame: A frame.
        seconds: Start time of the frame.
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


@dataclass(frozen=True, slots=True)
class FourdgsFrames:
    """The frames of a `.4dgs` file.

    Attributes:
        count: Number of frames.
        frames_per_second: Frame rate.
        read: Function that yields the Gaussians of each frame, and their ids `[N]`.
    """

    count: int
    frames_per_second: float
    read: Callable[[], Iterator[tuple[Splats, Int64]]]


def read_4dgs(data: bytes, frames_per_second: float | None = None) -> FourdgsFrames:
    """Open the frames of a `.4dgs` file, which is sampled in the middle of each frame.

    Args:
        data: The whole file.
        frames_per_second: Sampling rate; None for one frame per state, or for 30 if the
            file has no states.

    Raises:
        ValueError: The file is not a .4dgs file, or has more frames than a stream can have.
        ImportError: fourdgs is not installed.
    """
    with _rejecting():
        duration, pace, at = _open(data)
    pace = frames_per_second or pace
    count = round(duration * pace)
    if not (0 < duration < np.inf and 0 < count <= _MAX_FRAMES):
        message = f"{duration} seconds at {pace:.6g} frames per second are {count} frames"
        raise ValueError(message)

    def read() -> Iterator[tuple[Splats, Int64]]:
        for number in range(count):
            with _rejecting():
                frame = at((number + 0.5) / pace)
            yield frame

    return FourdgsFrames(count, pace, read)


@contextmanager
def _rejecting() -> Iterator[None]:
    """Convert the library's errors about a file to ValueError."""
    from fourdgs.exceptions import FourdgsError

    try:
        with np.errstate(all="ignore"):  # non-finite values are detected at the end
            yield
    except (FourdgsError, IndexError, OverflowError, MemoryError) as error:
        message = f"fourdgs cannot read it: {error}"
        raise ValueError(message) from error


_At = Callable[[float], tuple[Splats, Int64]]


def _open(data: bytes) -> tuple[float, float, _At]:
    """Return duration, frame rate, and a function that returns the state at a time."""
    import fourdgs
    from fourdgs.keyframe_delta_file import decode_streamed, render_at

    try:
        decoded = decode_streamed(data)
    except fourdgs.FourdgsError:
        scene = fourdgs.read(data)
        return float(scene.header.duration_sec), _USUAL_PACE, lambda time: _sample(scene, time)

    def at(time: float) -> tuple[Splats, Int64]:
        state = render_at(decoded, time)
        splats = _as_splats(
            state["centers"], state["scales"], state["rotations"], state["rgb"], state["opacity"]
        )
        return splats, state["ids"].astype(np.int64)

    duration = float(decoded.header.duration_sec)
    return duration, len(decoded.chunks) / max(duration, 1e-9), at


def _sample(scene: Any, time: float) -> tuple[Splats, Int64]:  # noqa: ANN401
    """Return the Gaussians of a scene with linear motion at a time."""
    gaussians = scene.gaussians
    state = gaussians.state_at(time)
    rows = state["indices"]
    splats = _as_splats(
        state["centers"],
        gaussians.scales[rows],
        state["orientations"],
        gaussians.colors[rows, :3],
        state["opacity"],
    )
    if gaussians.sh is not None:
        splats = replace(splats, sh=_join_harmonics(splats.sh, gaussians.sh[rows]))
    return splats, rows.astype(np.int64)


def _join_harmonics(base: Float32, levels: NDArray[np.uint8]) -> Float32:
    """Join SH coefficients to `[N, K, 3]`.

    Args:
        base: `[N, 1, 3]` coefficients of degree 0.
        levels: `[N, 3 (K - 1)]` coefficients of the other degrees, channel by channel.
    """
    from fourdgs.quantization import SH_QUANT_HI, SH_QUANT_LO

    rest = SH_QUANT_LO + levels.astype(np.float32) / 255 * (SH_QUANT_HI - SH_QUANT_LO)
    by_channel = rest.reshape(len(levels), 3, -1)
    joined: Float32 = np.concatenate([base, by_channel.transpose(0, 2, 1)], axis=1)
    return joined.astype(np.float32)


def _as_splats(
    centers: NDArray[Any],
    scales: NDArray[Any],
    rotations: NDArray[Any],
    colors: NDArray[Any],
    opacities: NDArray[Any],
) -> Splats:
    """Convert activated values to 3DGS form; opacities of 0 and 1 are moved slightly inwards.

    Raises:
        ValueError: A number is not finite.
    """
    opacities = np.clip(opacities, _NEARLY, 1 - _NEARLY)
    splats = Splats(
        np.asarray(centers, np.float32),
        np.roll(np.asarray(rotations, np.float32), 1, axis=1),
        np.log(np.maximum(scales, _TINY)).astype(np.float32),
        np.log(opacities / (1 - opacities)).astype(np.float32),
        ((np.asarray(colors, np.float32) - 0.5) / SH_BASE)[:, None].astype(np.float32),
    )
    if not all(np.isfinite(getattr(splats, name)).all() for name in _NUMBERS):
        message = "a number is not finite"
        raise ValueError(message)
    return splats


_NUMBERS = ("positions", "rotations", "log_scales", "opacities", "sh")
_MAX_FRAMES = 1 << 20
_USUAL_PACE = 30.0
_NEARLY = 1e-4
_TINY = 1e-12
