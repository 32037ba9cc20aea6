import base64

import pytest

from quarc_ref.evaluation.pages import embed_png, fill_page, format_lines


def test_a_page_has_its_parts_and_the_common_skin():
    page = fill_page("<style>$skin</style><p>$text</p>", {"text": "a b"}).decode()

    assert page.endswith("</style><p>a b</p>")
    assert "prefers-color-scheme: dark" in page


def test_a_part_that_is_missing_is_not_passed_over():
    with pytest.raises(KeyError, match="text"):
        fill_page("$skin $text", {})


def test_values_cannot_be_markup():
    assert format_lines({"a": 1, "<b>": "&"}) == ("<p><code>a: 1<br>&lt;b&gt;: &amp;</code></p>")


def test_a_picture_is_in_its_address():
    address = embed_png(b"\x89PNG")

    assert base64.b64decode(address.removeprefix("data:image/png;base64,")) == b"\x89PNG"
