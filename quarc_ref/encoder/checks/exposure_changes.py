"""Finds cameras whose exposure changes over time relative to the other cameras.

A change of all cameras in the same way is one of the light, and is not reported.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.encoder.checks.recording import Recording

_MIN_FRAMES = 3
_MIN_CAMERAS = 3
_MAX_REFERENCE_FRAMES = 15
_BLACK, _WHITE = 16, 240  # darker and brighter levels are not compared
_MIN_COMPARED_SHARE = 0.25  # of the pixels; otherwise, what moves could be most of them
_MAX_CHANGE = 0.05

Numbers = NDArray[np.float64]


def find_exposure_changes(
    names: Sequence[str], recordings: Sequence[Recording]
) -> Iterator[Finding]:
    """Yield a finding that lists the cameras whose exposure changes by more than 5 %."""
    gains = [measure_gains(recording) for recording in recordings]
    measured = [index for index, gain in enumerate(gains) if gain is not None]
    if len(measured) < _MIN_CAMERAS:
        return
    logarithms = np.log(np.stack([gain for gain in gains if gain is not None]))
    logarithms = logarithms[:, ~np.isnan(logarithms).all(axis=0)]  # frames of at least one camera
    own = logarithms - np.nanmedian(logarithms, axis=0)
    changes = np.expm1(np.nanmax(own, axis=1) - np.nanmin(own, axis=1))
    faulty = {names[measured[row]]: changes[row] for row in np.flatnonzero(changes > _MAX_CHANGE)}
    if faulty:
        descriptions = [f"{name} by {100 * change:.0f} %" for name, change in faulty.items()]
        message = (
            "the exposures of these cameras change over time relative to those of most cameras: "
            f"{format_names(descriptions)}. The encoder corrects them only in part: lock "
            "exposure, ISO and aperture, and use lamps that do not flicker"
        )
        yield Finding("exposure-changes", message, tuple(faulty))


def measure_gains(recording: Recording) -> Numbers | None:
    """Return the `[S]` exposures of the samples, relative to the camera's median picture.

    They are NaN for unreadable frames. The result is None if too few frames can be read, or too
    few pixels are neither dark nor bright.
    """
    readable = np.flatnonzero(recording.samples.is_usable)
    if len(readable) < _MIN_FRAMES:
        return None
    count = min(len(readable), _MAX_REFERENCE_FRAMES)
    chosen = readable[np.linspace(0, len(readable) - 1, count).round().astype(int)]
    levels = recording.samples.levels
    reference = np.median(levels[chosen], axis=0)
    is_compared = (reference > _BLACK) & (reference < _WHITE)
    if is_compared.mean() < _MIN_COMPARED_SHARE:
        return None
    gains: Numbers = np.full(len(levels), np.nan)
    for frame in readable:
        ratios = levels[frame][is_compared] / reference[is_compared]
        gains[frame] = max(float(np.median(ratios)), 1 / _WHITE)  # of a black frame: above 0
    return gains
