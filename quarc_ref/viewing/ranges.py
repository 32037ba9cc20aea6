"""Parses the Range header of requests (RFC 9110, section 14)."""

import re

_RANGE_PATTERN = re.compile(r"\s*bytes\s*=\s*(?P<first>\d{0,20})\s*-\s*(?P<last>\d{0,20})\s*")


def parse_range(header: str | None, size: int) -> range | None:
    """Return the range of a file that a Range header requests.

    Args:
        header: Value of the Range header; None for a request without this header.
        size: Size of the file, bytes.

    Returns:
        The range of bytes within the file; empty if the requested range is after the end. None
        stands for the whole file and is returned if the header is missing or malformed, or requests
        several ranges. RFC 9110 allows servers to ignore such headers.
    """
    match = _RANGE_PATTERN.fullmatch(header or "")
    if match is None or not (match["first"] or match["last"]):
        return None
    if not match["first"]:
        return range(max(0, size - int(match["last"])), size)
    first_byte, last_byte = int(match["first"]), int(match["last"] or size)
    return (
        None
        if last_byte < first_byte and match["last"]
        else range(min(first_byte, size), min(last_byte + 1, size))
    )
