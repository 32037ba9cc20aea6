"""Watches the training views during an encode, for cameras that are pushed or covered.

Before a frame is trained, its pictures are compared with the previous decoded scene, at the edges
in its renderings (`training.measurements.follow_exposures`). People who move hardly affect the
error of the median pixel there, but it grows at once if the camera moves.
"""

from collections.abc import Iterator, Sequence
from math import isfinite
from statistics import median

from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.ignored_frames import suggest_ignoring

# Largest growth from one frame to the next, relative to that of the median view; without faults, it
# is up to 1.2 (docs/experiments/capture-checks.md).
_MAX_GROWTH = 2.0
_MIN_ERROR = 2e-3  # smaller errors are not compared


class ViewWatch:
    """Compares the errors of the training views with those of the frame before.

    Args:
        names: Camera name of each view.
        start: Frame of the synchronized recording that is frame 0 of the stream.
    """

    def __init__(self, names: Sequence[str], start: int) -> None:
        self._names, self._start = names, start
        self._previous_errors: Sequence[float] = ()
        self._reported: set[str] = set()

    def begin(self, errors: Sequence[float]) -> None:
        """Set the `[V]` errors of a frame, with which those of the next one are compared.

        They are NaN for views that are not used. Without them, the first call of `check` sets them:
        frame 1 cannot be compared with frame 0, which was trained on its own pictures.
        """
        self._previous_errors = errors

    def check(self, errors: Sequence[float], frame: int) -> Iterator[Finding]:
        """Yield a finding for each view whose error grew far more than that of the others.

        A camera is reported once.

        Args:
            errors: `[V]` errors of the previous scene in a frame, NaN as in `begin`; empty if they
                were not measured.
            frame: Ordinal of the frame.
        """
        previous_errors, self._previous_errors = self._previous_errors, errors
        if not (errors and previous_errors):
            return
        growths = {
            name: max(error, _MIN_ERROR) / max(previous_error, _MIN_ERROR)
            for name, error, previous_error in zip(
                self._names, errors, previous_errors, strict=True
            )
            if isfinite(error) and isfinite(previous_error)
        }
        for name, growth in growths.items():
            relative_growth = growth / median(growths.values())
            if relative_growth > _MAX_GROWTH and name not in self._reported:
                self._reported.add(name)
                yield _report(name, relative_growth, self._start + frame)


def _report(name: str, growth: float, frame: int) -> Finding:
    message = (
        f"in frame {frame}, the error of {name} grew {growth:.1f} times as much as that of the "
        "other cameras, so this camera was probably pushed or covered. To go on without it, press "
        f"Ctrl-C, {suggest_ignoring(name, [(frame, None)])}, and use --resume"
    )
    return Finding("camera-changed", message, (name,))
