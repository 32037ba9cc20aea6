"""Errors raised by calibration; their messages suggest remedies."""

from quarc_ref.datasets.errors import CaptureError


class CalibrationError(CaptureError):
    """No poses can be found for the recordings."""


class UnknownCameraError(CaptureError):
    """An option names a camera that has no recording or no pose."""
