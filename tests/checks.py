"""Checks that tests apply to every reader of bytes."""

from collections.abc import Callable

import pytest

from quarc_ref.format.errors import BitstreamError


def check_reader(parse: Callable[[bytes], object], data: bytes, expected: object) -> None:
    """Check that a reader returns the record, and rejects every prefix and an additional byte."""
    assert parse(data) == expected
    for size in range(len(data)):
        with pytest.raises(BitstreamError):
            parse(data[:size])
    with pytest.raises(BitstreamError):
        parse(data + b"\0")
