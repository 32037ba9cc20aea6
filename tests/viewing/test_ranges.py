import pytest

from quarc_ref.viewing.ranges import parse_range


@pytest.mark.parametrize(
    ("header", "expected"),
    [
        ("bytes=0-", range(10)),
        ("bytes=0-3", range(4)),
        ("bytes=4-4", range(4, 5)),
        ("bytes=4-99", range(4, 10)),
        ("bytes=-3", range(7, 10)),
        ("bytes=-99", range(10)),
        (" bytes = 2 - 5 ", range(2, 6)),
        ("bytes=18446744073709551616-", range(10, 10)),
    ],
)
def test_a_range_is_within_the_file(header, expected):
    assert parse_range(header, 10) == expected


@pytest.mark.parametrize(("header", "size"), [("bytes=10-", 10), ("bytes=-0", 10), ("bytes=0-", 0)])
def test_a_range_beyond_the_end_has_no_bytes(header, size):
    found_range = parse_range(header, size)

    assert found_range is not None
    assert not found_range


@pytest.mark.parametrize(
    "header", [None, "", "bytes=-", "bytes=5-4", "bytes=0-1,4-5", "items=0-1", "bytes=a-b", "0-1"]
)
def test_an_invalid_range_is_treated_as_the_whole_file(header):
    assert parse_range(header, 10) is None
