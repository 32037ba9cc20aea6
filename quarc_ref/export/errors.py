"""What can keep frames from being exported, or from being read."""

from quarc_ref.format.errors import QuarcError


class ExportError(QuarcError):
    """A format cannot hold a frame."""


class UnreadableFramesError(QuarcError):
    """Files are no frames of Gaussians that can be read."""
