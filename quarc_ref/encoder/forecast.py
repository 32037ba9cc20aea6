"""Forecasts the time, memory and size of an encode on this machine.

The time is extrapolated from a few training steps on the capture's pictures and points. The
forecast of the size is a range (`size_model`), because the number of Gaussians is not known in
advance.
docs/experiments/forecast.md compares forecasts with completed encodes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.estimate import count_steps, estimate_step_seconds
from quarc_ref.encoder.monitoring.forecast import estimate_frame_seconds
from quarc_ref.encoder.monitoring.monitor import EncodePlan
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.config import EncoderConfig, limit_gaussians
from quarc_ref.encoder.size_model import (
    estimate_gaussians,
    estimate_stream_bytes,
    measure_subject_share,
)
from quarc_ref.encoder.training.context import TrainingContext, make_context

_FLOAT_BYTES = 4
# arrays per training picture: original, corrected exposure, and two moments of SSIM
_PICTURE_COPIES = 4
# Memory of a picture and its copy at half size, relative to the picture.
_HALF_SIZE_COPY_FACTOR = 1.25
_BASE_BYTES = 700 << 20  # memory of torch and other libraries
_DECODER_BYTES = 8 << 20  # memory of a camera's video decoder, without pictures
_DECODER_PICTURES = 20  # number of pictures that a video decoder holds
_PIXEL_BYTES = 1.5  # bytes per pixel of yuv420p
_PICTURE_CACHE_BYTES = 1 << 28  # size of the capture's picture cache
# floats per Gaussian: four copies (values, gradients, two moments of Adam) of 59 numbers
_FLOATS_PER_GAUSSIAN = 59 * 4
_ATTRIBUTE_FLOATS, _STATISTICS_FLOATS = 23, 3  # floats per Gaussian in a checkpoint


@dataclass(frozen=True, slots=True)
class Forecast:
    """Forecast of the time, memory and size of an encode.

    Attributes:
        seconds_of_first: Time for frame 0, extrapolated from training steps on this machine.
        seconds_per_frame: Time for each later frame, extrapolated from the same training steps.
        seconds: Time for all frames.
        memory_bytes: Upper bound on the main memory in use; with CUDA, device memory has the same
            bound.
        disk_bytes: Upper bound on the disk space for the stream and its checkpoint.
        stream_bytes: Lower and upper bounds on the size of the stream.
    """

    seconds_of_first: float
    seconds_per_frame: float
    seconds: float
    memory_bytes: int
    disk_bytes: int
    stream_bytes: tuple[int, int]


def forecast(
    capture: Capture, config: EncoderConfig, frames: int | None = None, device: str = "auto"
) -> Forecast:
    """Forecast the time, memory and size of an encode.

    Args:
        capture: Capture to encode.
        config: All settings.
        frames: Number of frames; None for all.
        device: Device, as in `EncodeOptions`.

    Raises:
        CaptureError: A picture cannot be read, or the capture has too few frames.
    """
    frame_count = capture.require_frames(frames)
    config = limit_gaussians(config, len(capture.training_at(0)))
    contexts = [
        make_context(capture, device, config.seed, downscale=downscale) for downscale in (1, 2)
    ]
    first_frame_seconds, later_frame_seconds = _forecast_seconds(
        capture, config, frame_count, contexts
    )
    share = measure_subject_share(contexts[0].views)
    gaussians = estimate_gaussians(len(capture.points.positions), config.canonical, share)
    min_bytes, _, max_bytes = map(int, estimate_stream_bytes(gaussians, config, frame_count))
    training_bytes = config.canonical.max_gaussians * _FLOATS_PER_GAUSSIAN * _FLOAT_BYTES
    other_bytes = _BASE_BYTES + _PICTURE_CACHE_BYTES + _count_picture_bytes(capture)
    return Forecast(
        seconds_of_first=first_frame_seconds,
        seconds_per_frame=later_frame_seconds,
        seconds=first_frame_seconds + later_frame_seconds * (frame_count - 1),
        memory_bytes=other_bytes + 2 * training_bytes,
        disk_bytes=max_bytes + 2 * _count_checkpoint_bytes(config.canonical),
        stream_bytes=(min_bytes, max_bytes),
    )


def _forecast_seconds(
    capture: Capture,
    config: EncoderConfig,
    frame_count: int,
    contexts: Sequence[TrainingContext],
) -> tuple[float, float]:
    """Return the seconds for frame 0 and for each later frame.

    Args:
        capture: Capture to encode.
        config: All settings.
        frame_count: Number of frames.
        contexts: At full and at half resolution; a few training steps of each are timed.
    """
    canonical = config.canonical
    full_step_seconds, half_step_seconds = (
        estimate_step_seconds(context, capture.points, config) for context in contexts
    )
    full_steps, half_steps = count_steps(canonical)
    plan = EncodePlan(
        capture.name,
        frame_count,
        first_frame=0,
        byte_count=0,
        views=len(capture.training_at(0)),
        canonical_steps=canonical.training_steps,
        half_resolution_steps=canonical.half_resolution_steps,
        motion_steps=config.motion.iterations,
        birth_steps=config.births.iterations,
    )
    first_frame_seconds = half_steps * half_step_seconds + full_steps * full_step_seconds
    return first_frame_seconds, estimate_frame_seconds(plan, full_step_seconds)


def _count_checkpoint_bytes(canonical: CanonicalSettings) -> int:
    """Return the maximum size of a checkpoint; while it is replaced, the disk holds two."""
    copies = 3 + canonical.scene_count  # values, two moments of Adam, and finished scenes
    floats = copies * _ATTRIBUTE_FLOATS + _STATISTICS_FLOATS
    return canonical.max_gaussians * floats * _FLOAT_BYTES


def _count_picture_bytes(capture: Capture) -> int:
    """Return the memory that the pictures and the video decoders need, bytes."""
    cameras = [capture.cameras[index] for index in capture.training]
    pixel_count = sum(camera.width * camera.height for camera in cameras)
    training_picture_bytes = (
        pixel_count * 3 * _FLOAT_BYTES * _PICTURE_COPIES * _HALF_SIZE_COPY_FACTOR
    )
    return int(
        training_picture_bytes
        + len(cameras) * _DECODER_BYTES
        + pixel_count * _DECODER_PICTURES * _PIXEL_BYTES
    )
