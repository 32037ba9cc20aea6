"""Errors of exporting frames and of reading them."""

from quarc_ref.format.errors import QuarcError


class ExportError(QuarcError):
    """A format cannot represent a frame."""


class UnreadableFramesError(QuarcError):
    """Files do not contain readable frames of Gaussians."""
