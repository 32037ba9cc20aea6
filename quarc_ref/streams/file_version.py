"""Detects whether a file on a server has changed."""

from dataclasses import dataclass
from email.message import Message
from enum import Enum


class Change(Enum):
    """How a file has changed."""

    NONE = "none"
    GROWN = "grown, or replaced by a longer file"
    REPLACED = "replaced"


@dataclass(frozen=True, slots=True)
class FileVersion:
    """The version of a file according to HTTP headers; a field without a header is None.

    Attributes:
        size: Size of the file, bytes.
        etag: ETag of the file, if it is strong.
        modified: Time of the last modification, as sent by the server.
    """

    size: int | None = None
    etag: str | None = None
    modified: str | None = None

    @classmethod
    def from_headers(cls, headers: Message, size: int | None) -> "FileVersion":
        """Return the version that the headers of a response describe."""
        etag = headers.get("ETag")
        is_strong = etag is not None and not etag.startswith("W/")
        return cls(size, etag if is_strong else None, headers.get("Last-Modified"))

    def compare(self, later: "FileVersion") -> Change:
        """Return how the file has changed according to a later response.

        Most servers derive the ETag from the size and modification time. The ETag of a growing
        file therefore changes, and does not show whether its beginning is unchanged.
        """
        validators = ((self.etag, later.etag), (self.modified, later.modified))
        validator = next((pair for pair in validators if None not in pair), (None, None))
        validator_changed = validator[0] != validator[1]
        if self.size is not None and later.size is not None:
            if later.size > self.size:
                return Change.GROWN
            if later.size < self.size or validator_changed:
                return Change.REPLACED
        return Change.GROWN if validator_changed else Change.NONE

    def merged_with(self, later: "FileVersion") -> "FileVersion":
        """Return this version, updated with the headers of a later response.

        The ETag and modification time of another size do not describe the file any more: a
        response without them, such as 416, leaves them unknown.
        """
        if later.size is not None and self.size not in (None, later.size):
            return later
        return FileVersion(
            self.size if later.size is None else later.size,
            later.etag or self.etag,
            later.modified or self.modified,
        )
