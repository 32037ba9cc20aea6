"""Writes and reads `.4dgs` files with the library fourdgs.

Files are written with the temporal model `keyframe-delta`, which does not support
view-dependent color. The library's profile `fine` limits the quantization errors.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Float32, Splats
from quarc_ref.export.activate import (
    compute_base_colors,
    compute_opacities,
    compute_scales,
    convert_to_xyzw,
)
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.errors import ExportError
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import SH_C0
from quarc_ref.format.frame_rate import is_frame_rate

# seconds; makes the opacity constant (the temporal model does not accept infinity)
_CONSTANT_OPACITY_SIGMA = 1e9


class SequenceExporter:
    """Collects all frames in one file; the first frame is at time 0.

    Args:
        clip: Properties of the stream.
    """

    def __init__(self, clip: Clip) -> None:
        self._clip = clip
        self._samples: list[Any] = []
        self._first_frame = 0
        self._end_time = 0.0

    def add(self, frame: Frame) -> None:
        """Append a frame."""
        if not self._samples:
            self._first_frame = frame.scene.frame
        start_time = self._clip.compute_time(frame.scene.frame - self._first_frame)
        self._end_time = self._clip.compute_time(frame.scene.frame - self._first_frame + 1)
        self._samples.append(make_sample(frame, start_time))

    def finish(self) -> bytes:
        """Build the file.

        Raises:
            ExportError: The library rejects the frames.
        """
        from fourdgs.exceptions import FourdgsError
        from fourdgs.keyframe_delta_file import write_sequence

        try:
            with np.errstate(all="ignore"):  # the library rejects numbers that it cannot quantize
                data: bytes = write_sequence(
                    self._samples, self._end_time, profile="fine", library="quarc-ref"
                )
        except (FourdgsError, ValueError) as error:
            message = f"fourdgs cannot write the frames: {error}"
            raise ExportError(message) from error
        return data


def make_sample(frame: Frame, start_time: float) -> Any:  # noqa: ANN401
    """Convert a frame to the library's `Sample`.

    Args:
        frame: A frame.
        start_time: Start time of the frame, seconds.
    """
    from fourdgs import GaussianSet
    from fourdgs.keyframe_delta_writer import Sample

    splats, gaussian_count = frame.splats, frame.scene.count
    opacities = compute_opacities(splats)[:, None]
    gaussians = GaussianSet(
        positions=splats.positions,
        scales=compute_scales(splats),
        rotations=convert_to_xyzw(splats.rotations),
        colors=np.concatenate([compute_base_colors(splats), opacities], axis=1),
        motions=np.zeros((gaussian_count, 3), dtype=np.float32),
        mu_t=np.zeros(gaussian_count),
        sigma_t=np.full(gaussian_count, _CONSTANT_OPACITY_SIGMA),
        win_lo=np.zeros(gaussian_count),
        win_hi=np.full(gaussian_count, np.inf),
    )
    return Sample(start_time, frame.scene.ids, gaussians)


@dataclass(frozen=True, slots=True)
class FourdgsFrames:
    """The frames of a `.4dgs` file.

    Attributes:
        count: Number of frames.
        frames_per_second: Frame rate.
        read: Function that yields the Gaussians of each frame and their ids `[N]`.
    """

    count: int
    frames_per_second: float
    read: Callable[[], Iterator[tuple[Splats, Int64]]]


def read_4dgs(data: bytes, frames_per_second: float | None = None) -> FourdgsFrames:
    """Open the frames of a `.4dgs` file; each frame is sampled at the middle of its duration.

    Args:
        data: Bytes of the file.
        frames_per_second: Sampling rate. If it is None, a keyframe-delta file is sampled once per
            stored state, and any other file 30 times per second.

    Raises:
        ValueError: The file is not a `.4dgs` file, or has too many frames.
        ImportError: The library fourdgs is not installed.
    """
    with _convert_errors():
        duration, frame_rate, sample_at = _open_file(data)
    frame_rate = frames_per_second or frame_rate
    if not is_frame_rate(frame_rate):
        message = f"a stream cannot have {frame_rate:.3g} frames per second"
        raise ValueError(message)
    frame_count = round(duration * frame_rate)
    if not (0 < duration < np.inf and 0 < frame_count <= _MAX_FRAMES):
        message = f"the file has {frame_count} frames; from 1 to {_MAX_FRAMES} are allowed"
        raise ValueError(message)

    def read() -> Iterator[tuple[Splats, Int64]]:
        for index in range(frame_count):
            with _convert_errors():
                frame = sample_at((index + 0.5) / frame_rate)
            yield frame

    return FourdgsFrames(frame_count, frame_rate, read)


@contextmanager
def _convert_errors() -> Iterator[None]:
    """Convert errors of the library to ValueError."""
    from fourdgs.exceptions import FourdgsError

    try:
        with np.errstate(all="ignore"):  # `_as_splats` rejects non-finite numbers
            yield
    except (FourdgsError, IndexError, OverflowError, MemoryError) as error:
        message = f"fourdgs cannot read the file: {error}"
        raise ValueError(message) from error


_Sampler = Callable[[float], tuple[Splats, Int64]]


def _open_file(data: bytes) -> tuple[float, float, _Sampler]:
    """Return the duration in seconds, the frame rate, and a function that samples the file."""
    import fourdgs
    from fourdgs.keyframe_delta_file import decode_streamed, render_at

    try:
        decoded = decode_streamed(data)
    except fourdgs.FourdgsError:
        scene = fourdgs.read(data)
        return (
            float(scene.header.duration_sec),
            _DEFAULT_FRAME_RATE,
            lambda time: _sample_scene(scene, time),
        )

    def sample_at(time: float) -> tuple[Splats, Int64]:
        state = render_at(decoded, time)
        splats = _as_splats(
            state["centers"], state["scales"], state["rotations"], state["rgb"], state["opacity"]
        )
        return splats, state["ids"].astype(np.int64)

    duration = float(decoded.header.duration_sec)
    return duration, len(decoded.chunks) / max(duration, 1e-9), sample_at


def _sample_scene(scene: Any, time: float) -> tuple[Splats, Int64]:  # noqa: ANN401
    """Sample a scene with linear motion at a given time; return the Gaussians and their ids."""
    gaussians = scene.gaussians
    state = gaussians.state_at(time)
    indices = state["indices"]
    splats = _as_splats(
        state["centers"],
        gaussians.scales[indices],
        state["orientations"],
        gaussians.colors[indices, :3],
        state["opacity"],
    )
    if gaussians.sh is not None:
        splats = replace(splats, sh=_join_sh(splats.sh, gaussians.sh[indices]))
    return splats, indices.astype(np.int64)


def _join_sh(sh_dc: Float32, sh_rest_levels: NDArray[np.uint8]) -> Float32:
    """Join SH DC and SH rest to `[N, K, 3]`.

    Args:
        sh_dc: `[N, 1, 3]` SH DC.
        sh_rest_levels: `[N, 3 (K - 1)]` SH rest as 8-bit levels, channel by channel.
    """
    from fourdgs.quantization import SH_QUANT_HI, SH_QUANT_LO

    sh_rest = SH_QUANT_LO + sh_rest_levels.astype(np.float32) / 255 * (SH_QUANT_HI - SH_QUANT_LO)
    channel_rest = sh_rest.reshape(len(sh_rest_levels), 3, -1)
    sh: Float32 = np.concatenate([sh_dc, channel_rest.transpose(0, 2, 1)], axis=1)
    return sh.astype(np.float32)


def _as_splats(
    centers: NDArray[Any],
    scales: NDArray[Any],
    rotations: NDArray[Any],
    colors: NDArray[Any],
    opacities: NDArray[Any],
) -> Splats:
    """Convert activated attributes to splats; opacities are clamped to [1e-4, 1 - 1e-4].

    Raises:
        ValueError: A number is not finite.
    """
    opacities = np.clip(opacities, _MIN_OPACITY, 1 - _MIN_OPACITY)
    splats = Splats(
        np.asarray(centers, np.float32),
        np.roll(np.asarray(rotations, np.float32), 1, axis=1),
        np.log(np.maximum(scales, _MIN_SCALE)).astype(np.float32),
        np.log(opacities / (1 - opacities)).astype(np.float32),
        ((np.asarray(colors, np.float32) - 0.5) / SH_C0)[:, None].astype(np.float32),
    )
    if not all(np.isfinite(getattr(splats, name)).all() for name in _ATTRIBUTE_NAMES):
        message = "a number in the file is not finite"
        raise ValueError(message)
    return splats


_ATTRIBUTE_NAMES = ("positions", "rotations", "log_scales", "opacities", "sh")
_MAX_FRAMES = 1 << 20
_DEFAULT_FRAME_RATE = 30.0
_MIN_OPACITY = 1e-4
_MIN_SCALE = 1e-12
