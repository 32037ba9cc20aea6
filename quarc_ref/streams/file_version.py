"""Detects whether a file on a server has changed."""

from dataclasses import dataclass
from email.message import Message
from enum import Enum


class Change(Enum):
    """The kind of change of a file."""

    NONE = "none"
    GROWN = "grown, or replaced by a longer one"
    REPLACED = "replaced"


@dataclass(frozen=True, slots=True)
class FileVersion:
    """Properties of a file from a server's headers; None for missing headers.

    Attributes:
        size: Size of the file, bytes.
        tag: ETag of the file, if it is strong.
        modified: Time of the last modification, as sent by the server.
    """

    size: int | None = None
    tag: str | None = None
    modified: str | None = None

    @classmethod
    def of(cls, headers: Message, size: int | None) -> "FileVersion":
        """Return the version that the headers of a response describe."""
        tag = headers.get("ETag")
        is_strong = tag is not None and not tag.startswith("W/")
        return cls(size, tag if is_strong else None, headers.get("Last-Modified"))

    def compare(self, later: "FileVersion") -> Change:
        """How the file has changed, according to a later response.

        Most servers derive the ETag from size and time, so the ETag of a growing file
        changes and does not show whether its beginning is unchanged.
        """
        marks = ((self.tag, later.tag), (self.modified, later.modified))
        mark = next((pair for pair in marks if None not in pair), (None, None))
        has_other_mark = mark[0] != mark[1]
        if self.size is not None and later.size is not None:
            if later.size > self.size:
                return Change.GROWN
            if later.size < self.size or has_other_mark:
                return Change.REPLACED
        return Change.GROWN if has_other_mark else Change.NONE

    def updated(self, later: "FileVersion") -> "FileVersion":
        """Return this version, completed with the headers of a later response."""
        return FileVersion(
            self.size if later.size is None else later.size,
            later.tag or self.tag,
            later.modified or self.modified,
        )
