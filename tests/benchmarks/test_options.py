import argparse

import pytest

from options import parse_count, parse_positive


def test_numbers_from_the_minimum_on_are_accepted():
    assert (parse_count("0"), parse_positive("1"), parse_positive("30")) == (0, 1, 30)


@pytest.mark.parametrize(
    ("parse", "text", "minimum"),
    [(parse_count, "-1", 0), (parse_positive, "0", 1), (parse_positive, "many", 1)],
)
def test_other_numbers_and_texts_are_rejected(parse, text, minimum):
    message = f"'{text}' is not a whole number of at least {minimum}"

    with pytest.raises(argparse.ArgumentTypeError, match=message):
        parse(text)
