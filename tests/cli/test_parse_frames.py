import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.options import parse_frames

_ORDINALS = st.integers(0, 10**6)


@given(_ORDINALS, st.integers(1, 10**6))
def test_a_range_is_parsed(start, count):
    assert parse_frames(f"{start}:{start + count}") == (start, start + count)


@given(_ORDINALS)
def test_a_missing_end_is_the_end_of_the_stream(number):
    assert parse_frames(f"{number}:") == (number, None)
    assert parse_frames(f":{number + 1}") == (0, number + 1)


@given(_ORDINALS)
def test_one_number_is_a_single_frame(number):
    assert parse_frames(f"{number}") == (number, number + 1)


@pytest.mark.parametrize("text", [None, ":", "0:"])
def test_all_frames_can_be_written_in_three_ways(text):
    assert parse_frames(text) == (0, None)


@given(_ORDINALS, st.integers(0, 10**6))
def test_an_empty_range_is_rejected(stop, excess):
    with pytest.raises(UsageError, match="empty"):
        parse_frames(f"{stop + excess}:{stop}")


@given(st.text(max_size=6).filter(lambda text: ":" not in text and not text.isdecimal()))
def test_text_without_a_colon_that_is_not_a_number_is_rejected(text):
    with pytest.raises(UsageError, match="A:B"):
        parse_frames(text)


@pytest.mark.parametrize(
    "text", ["-1:2", "a:b", "1:2:3", "1.0:2", " 1:2", "1:\u00b2", "", 5000 * "9" + ":", 5000 * "9"]
)
def test_text_without_numbers_is_rejected(text):
    with pytest.raises(UsageError, match="A:B"):
        parse_frames(text)
