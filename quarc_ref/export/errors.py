"""Errors of exporting and importing frames."""

from quarc_ref.format.errors import QuarcError


class ExportError(QuarcError):
    """A frame cannot be converted to a format."""


class UnreadableFramesError(QuarcError):
    """Files do not contain readable frames of Gaussians."""


class NoFramesError(UnreadableFramesError):
    """A file or folder has no frames in a supported format."""
