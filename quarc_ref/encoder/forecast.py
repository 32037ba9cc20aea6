"""Forecasts time, memory and size of an encode on this machine.

Times are measured by running some training steps on the capture's pictures and points.
The final scene is not known in advance, so the size is a range;
docs/experiments/forecast.md compares forecasts with encodes.
"""

from dataclasses import dataclass

from quarc_ref.datasets.capture import Capture
from quarc_ref.encoder.estimate import time_step
from quarc_ref.encoder.monitoring.forecast import frame_seconds
from quarc_ref.encoder.monitoring.monitor import EncodePlan
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.exposure import Exposures
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.rendering.backends import choose_device, choose_rasterizer

_FLOAT_BYTES = 4
# buffers per training picture: original, corrected, and two moments of the SSIM
_PICTURE_COPIES = 4
_HALF = 1.25  # including the picture at half size
_BASE_BYTES = 700 << 20  # memory of torch and other libraries
_DECODER_BYTES = 8 << 20  # memory of a camera's video decoder, and its pictures:
_DECODER_PICTURES = 20
_PIXEL_BYTES = 1.5  # bytes per pixel of yuv420p
_CACHE_BYTES = 1 << 28  # size of the capture's picture cache
# copies of a Gaussian's numbers: values, gradients, and Adam's two moments
_NUMBERS_TRAINED = 59 * 4
_BYTES_PER_GAUSSIAN = (7, 11)
_FRAME_BYTES_PER_GAUSSIAN = (0.05, 0.4)
_SHARE_OF_GAUSSIANS = (0.25, 1.0)  # share of the maximum number of Gaussians that remains


@dataclass(frozen=True, slots=True)
class Forecast:
    """Time, memory and size of an encode.

    Attributes:
        seconds_of_first: Time for frame 0, measured on this machine.
        seconds_per_frame: Time per later frame, measured on this machine.
        seconds: Time for all frames.
        memory_bytes: Upper bound of main memory, and on CUDA also of device memory.
        disk_bytes: Disk space for the stream and its checkpoint.
        stream_bytes: Lower and upper bound of the size of the stream.
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
    """Forecast time, memory and size of an encode.

    Args:
        capture: Capture to encode.
        config: All settings.
        frames: Number of frames; None for all.
        device: Device, as in `EncodeOptions`.

    Raises:
        CaptureError: A picture cannot be read, or the capture has too few frames.
    """
    count = capture.require_frames(frames)
    canonical = config.canonical
    gaussians = canonical.max_gaussians
    contexts = [_make_context(capture, config, device, downscale) for downscale in (1, 2)]
    full, half = (time_step(context, capture.points, config) for context in contexts)
    halved = min(canonical.half_resolution_until_iter, canonical.iterations)
    first = halved * half + (canonical.iterations - halved) * full
    plan = EncodePlan(
        capture.name,
        count,
        first_frame=0,
        byte_count=0,
        views=len(capture.training),
        canonical_steps=canonical.iterations,
        motion_steps=config.motion.iterations,
        birth_steps=config.births.iterations,
    )
    each = frame_seconds(plan, full)
    low, high = (
        int(share * gaussians * (of_first + of_frame * (count - 1)))
        for share, of_first, of_frame in zip(
            _SHARE_OF_GAUSSIANS, _BYTES_PER_GAUSSIAN, _FRAME_BYTES_PER_GAUSSIAN, strict=True
        )
    )
    training = gaussians * _NUMBERS_TRAINED * _FLOAT_BYTES
    return Forecast(
        seconds_of_first=first,
        seconds_per_frame=each,
        seconds=first + each * (count - 1),
        memory_bytes=_BASE_BYTES + _CACHE_BYTES + _count_picture_bytes(capture) + 2 * training,
        disk_bytes=high + training,
        stream_bytes=(low, high),
    )


def _count_picture_bytes(capture: Capture) -> int:
    """Return the bytes that a frame's training pictures take in training and decoders."""
    cameras = [capture.cameras[index] for index in capture.training]
    pixels = sum(camera.width * camera.height for camera in cameras)
    trained = pixels * 3 * _FLOAT_BYTES * _PICTURE_COPIES * _HALF
    return int(trained + len(cameras) * _DECODER_BYTES + pixels * _DECODER_PICTURES * _PIXEL_BYTES)


def _make_context(
    capture: Capture, config: EncoderConfig, device: str, downscale: int
) -> TrainingContext:
    where = choose_device(device)
    views = TrainingViews(capture, where, downscale)
    return TrainingContext(
        views,
        choose_rasterizer(where),
        config.seed,
        Exposures(len(views.cameras), where),
    )
