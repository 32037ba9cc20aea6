"""What can keep a frame from being exported."""

from quarc_ref.format.errors import QuarcError


class ExportError(QuarcError):
    """A format cannot hold a frame."""
