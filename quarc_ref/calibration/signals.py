"""Signals that are common to recordings of one event: loudness and motion."""

import numpy as np
from numpy.typing import NDArray

from quarc_ref.calibration.alignment import Numbers, flatten
from quarc_ref.datasets.capture import Image, PictureSource
from quarc_ref.datasets.sound import Sound

Motion = NDArray[np.float32]

WINDOW = 9  # frames: length of the running mean that is subtracted from a signal
_LOUDNESS_WINDOW = 0.3  # seconds
_QUIET = 1e-3  # floor of the power, relative to its mean
_ACROSS = 64  # maximum number of pixels of the pictures whose changes are measured
_NOISE = 2.0  # levels of 255 below which a change is noise
_MAX_CHANGE = 20.0  # levels of 255: larger changes are clipped to this
_STILL = 1e-3  # levels of 255: smaller changes are raised to this


def measure_loudness(sound: Sound, first_picture: float, levels_per_second: float) -> Numbers:
    """Measure the loudness of a sound, starting at the time of the first picture.

    Args:
        sound: Sound of a recording.
        first_picture: Time of the first picture in seconds, on the clock of the container.
        levels_per_second: Sampling rate of the loudness.

    Returns:
        `[T, 1]` logarithms of power, minus their running mean.
    """
    samples = sound.samples.astype(np.float64)
    times = sound.start - first_picture + np.arange(len(samples)) / sound.samples_per_second
    bins = np.floor(times * levels_per_second).astype(np.int64)
    inside = bins >= 0
    power = np.bincount(bins[inside], samples[inside] ** 2)
    counts = np.bincount(bins[inside])
    mean = power / np.maximum(counts, 1)
    levels = np.log(mean + _QUIET * max(float(mean.mean() if mean.size else 0), 1e-12))
    return flatten(levels[:, None], round(_LOUDNESS_WINDOW * levels_per_second) | 1)


def measure_motion(source: PictureSource, camera: int, frames: int) -> Motion:
    """Measure the changes between consecutive pictures of a camera.

    Args:
        source: Source of the pictures.
        camera: Index of the camera.
        frames: Number of frames read, from the first.

    Returns:
        `[frames - 1, h, w]` changes of gray, 0 to 255, in downscaled pictures.

    Raises:
        CaptureError: A picture cannot be read.
    """
    changes = []
    before = _downscale(source.read(camera, 0))
    for frame in range(1, frames):
        after = _downscale(source.read(camera, frame))
        changes.append(np.clip(np.abs(after - before) - _NOISE, 0, _MAX_CHANGE))
        before = after
    return np.stack(changes)


def sum_motion(motion: Motion) -> Numbers:
    """Return `[T, 1]` logarithms of the mean change of each frame, minus their running mean."""
    return flatten(np.log(motion.mean(axis=(1, 2), dtype=np.float64) + _STILL)[:, None], WINDOW)


def _downscale(picture: Image) -> NDArray[np.float32]:
    """Return `[h, w]` gray levels of a picture, downscaled by averaging."""
    gray = picture.mean(axis=2, dtype=np.float32)
    step = find_step(gray.shape[1])
    height, width = (side // step * step for side in gray.shape)
    blocks = gray[:height, :width].reshape(height // step, step, width // step, step)
    return np.asarray(blocks.mean(axis=(1, 3)), np.float32)


def find_step(width: int) -> int:
    """Return the factor by which pictures are downscaled to measure motion."""
    return max(1, width // _ACROSS)
