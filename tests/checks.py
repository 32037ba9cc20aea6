"""What every reader of bytes must stand."""

from collections.abc import Callable

import pytest

from quarc_ref.format.errors import BitstreamError


def check_reader(parse: Callable[[bytes], object], data: bytes, expected: object) -> None:
    """A reader gives the record of the whole, and rejects every part and every extension."""
    assert parse(data) == expected
    for size in range(len(data)):
        with pytest.raises(BitstreamError):
            parse(data[:size])
    with pytest.raises(BitstreamError):
        parse(data + b"\0")
