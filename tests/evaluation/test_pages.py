import base64

import pytest

from quarc_ref.evaluation.pages import embed_png, fill_page, format_lines, format_texts


def test_a_page_has_its_parts_and_the_common_style():
    page = fill_page("<style>$skin</style><p>$text</p>", {"text": "a b"}).decode()

    assert page.endswith("</style><p>a b</p>")
    assert "prefers-color-scheme: dark" in page


def test_a_name_that_is_no_valid_utf_8_is_shown_with_a_mark():
    assert fill_page("$skin$text", {"text": "a\udcffb"}).endswith(b"a?b")


def test_a_missing_part_is_an_error():
    with pytest.raises(KeyError, match="text"):
        fill_page("$skin $text", {})


def test_values_are_escaped():
    assert format_lines({"a": 1, "<b>": "&"}) == ("<p><code>a: 1<br>&lt;b&gt;: &amp;</code></p>")


def test_texts_are_escaped_and_one_per_line():
    assert format_texts(["psnr: a", "<b>"]) == "<p><code>psnr: a<br>&lt;b&gt;</code></p>"


def test_a_picture_is_embedded_as_a_data_url():
    address = embed_png(b"\x89PNG")

    assert base64.b64decode(address.removeprefix("data:image/png;base64,")) == b"\x89PNG"
