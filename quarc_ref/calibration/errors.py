"""What can make a calibration fail, by name; each message says what to do."""

from quarc_ref.datasets.errors import CaptureError


class CalibrationError(CaptureError):
    """No poses can be found for the recordings as they are."""


class UnknownCameraError(CaptureError):
    """An option names a camera that there is no recording of, or that did not join."""
