"""Checks for every reader of bytes."""

from collections.abc import Callable

import pytest

from quarc_ref.format.errors import BitstreamError


def check_reader(parse: Callable[[bytes], object], data: bytes, expected: object) -> None:
    """A reader returns the whole record, and rejects every prefix and every extension."""
    assert parse(data) == expected
    for size in range(len(data)):
        with pytest.raises(BitstreamError):
            parse(data[:size])
    with pytest.raises(BitstreamError):
        parse(data + b"\0")
