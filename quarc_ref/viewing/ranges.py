"""The Range header of a request (RFC 9110, 14)."""

import re

_ONE_RANGE = re.compile(r"\s*bytes\s*=\s*(?P<first>\d{0,20})\s*-\s*(?P<last>\d{0,20})\s*")


def find_range(header: str | None, size: int) -> range | None:
    """Return the bytes of a file that a request asks for.

    Args:
        header: Value of the Range header; None without one.
        size: Bytes of the file.

    Returns:
        The range of bytes, within the file; empty if it lies beyond its end. None means the whole
        file: if there is no header, or if it is malformed or has several ranges, which a server
        may ignore.
    """
    match = _ONE_RANGE.fullmatch(header or "")
    if match is None or not (match["first"] or match["last"]):
        return None
    if not match["first"]:
        return range(max(0, size - int(match["last"])), size)
    first, last = int(match["first"]), int(match["last"] or size)
    return None if last < first and match["last"] else range(min(first, size), min(last + 1, size))
