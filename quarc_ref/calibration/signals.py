"""Measures loudness and motion, which are used to synchronize recordings of the same event."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.calibration.alignment import Float64Array, subtract_running_mean
from quarc_ref.datasets.capture import Image, PictureSource
from quarc_ref.datasets.sound import Sound

Motion = NDArray[np.float32]

MOTION_WINDOW = 9  # frames: length of the running mean that is subtracted from a signal
_LOUDNESS_WINDOW = 0.3  # seconds
_POWER_FLOOR = 1e-3  # relative to the mean power; added before the logarithm
_MIN_DOWNSCALED_WIDTH = 64  # pixels; the downscaling factor is an integer
_NOISE_THRESHOLD = 2.0  # 8-bit levels; smaller changes are noise
_MAX_CHANGE = 20.0  # 8-bit levels; larger changes are clipped
_CHANGE_FLOOR = 1e-3  # 8-bit levels; added to mean changes before the logarithm


def measure_loudness(sound: Sound, first_picture_time: float, loudness_rate: float) -> Float64Array:
    """Measure the loudness of a sound, starting at the time of the first picture.

    Args:
        sound: Sound of a recording.
        first_picture_time: Time stamp of the first picture in the container, seconds.
        loudness_rate: Sampling rate of the result, Hz.

    Returns:
        `[T, 1]` logarithm of the power, minus its running mean.
    """
    samples = sound.samples.astype(np.float64)
    times = sound.start - first_picture_time + np.arange(len(samples)) / sound.samples_per_second
    bins = np.floor(times * loudness_rate).astype(np.int64)
    is_inside = bins >= 0
    power_sums = np.bincount(bins[is_inside], samples[is_inside] ** 2)
    counts = np.bincount(bins[is_inside])
    powers = power_sums / np.maximum(counts, 1)
    mean_power = float(powers.mean() if powers.size else 0)
    loudness = np.log(powers + _POWER_FLOOR * max(mean_power, 1e-12))
    return subtract_running_mean(loudness[:, None], round(_LOUDNESS_WINDOW * loudness_rate) | 1)


def measure_motion(source: PictureSource, camera: int, frame_count: int) -> Motion:
    """Measure the changes between consecutive pictures of a camera.

    Args:
        source: Source of the pictures.
        camera: Index of the camera.
        frame_count: Number of frames to read, starting at frame 0.

    Returns:
        `[frame_count - 1, h, w]` absolute changes of the downscaled gray pictures, minus the
        noise threshold and clipped to 0 to `_MAX_CHANGE`, in 8-bit levels.

    Raises:
        CaptureError: A picture cannot be read.
    """
    changes = []
    previous = _downscale(source.read(camera, 0))
    for frame in range(1, frame_count):
        current = _downscale(source.read(camera, frame))
        changes.append(np.clip(np.abs(current - previous) - _NOISE_THRESHOLD, 0, _MAX_CHANGE))
        previous = current
    return np.stack(changes)


def make_motion_signal(motion: Motion) -> Float64Array:
    """Return `[T, 1]`: the logarithm of the mean change per frame, minus its running mean."""
    mean_changes = motion.mean(axis=(1, 2), dtype=np.float64)
    return subtract_running_mean(np.log(mean_changes + _CHANGE_FLOOR)[:, None], MOTION_WINDOW)


def _downscale(picture: Image) -> NDArray[np.float32]:
    """Return `[h, w]` gray levels of a picture, downscaled by averaging."""
    gray = picture.mean(axis=2, dtype=np.float32)
    factor = find_downscale_factor(gray.shape[1])
    height, width = (side // factor * factor for side in gray.shape)
    blocks = gray[:height, :width].reshape(height // factor, factor, width // factor, factor)
    return np.asarray(blocks.mean(axis=(1, 3)), np.float32)


def find_downscale_factor(width: int) -> int:
    """Return the factor by which pictures of this width are downscaled to measure motion."""
    return max(1, width // _MIN_DOWNSCALED_WIDTH)
