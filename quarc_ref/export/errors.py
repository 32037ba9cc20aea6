"""Errors of exporting frames and of reading them."""

from quarc_ref.format.errors import QuarcError


class ExportError(QuarcError):
    """A format cannot represent a frame."""


class UnreadableFramesError(QuarcError):
    """Files do not contain readable frames of Gaussians."""


class NoFramesError(UnreadableFramesError):
    """A file or folder is not of a kind that frames are read from."""
