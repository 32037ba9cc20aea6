from html.parser import HTMLParser

import pytest

from quarc_ref.viewing.page import PageOptions, build_iframe, build_page, read_player


class Elements(HTMLParser):
    """The elements of a page with their attributes, and its title."""

    def __init__(self, text):
        super().__init__()
        self.found, self.title, self._open = {}, "", None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.setdefault(tag, []).append(dict(attrs))
        self._open = tag

    def handle_data(self, data):
        if self._open == "title":
            self.title += data.strip()


def _read(options, **more):
    return Elements(build_page(options, **more).decode())


def test_the_player_has_the_requested_attributes():
    page = _read(PageOptions("t", camera="cam03", up="-y", autoplay=True, loop=True, live=True))

    assert page.found["quarc-player"] == [
        {
            "src": "stream.quarc",
            "camera": "cam03",
            "up": "-y",
            "autoplay": None,
            "loop": None,
            "live": None,
        }
    ]


def test_an_attribute_that_is_not_requested_is_left_out():
    assert _read(PageOptions("t")).found["quarc-player"] == [{"src": "stream.quarc"}]


@pytest.mark.parametrize(
    "text", ['"><script>alert(1)</script>', "a & b", "'quoted'", "$title ${x}"]
)
def test_text_is_escaped(text):
    page = _read(PageOptions(text, camera=text))

    assert page.title == text
    assert page.found["quarc-player"][0]["camera"] == text
    assert len(page.found["script"]) == 2


def test_a_poster_is_shown_before_the_player_and_in_it():
    page = _read(PageOptions("t"), has_poster=True)

    assert page.found["quarc-player"][0]["poster"] == "poster.jpg"
    assert page.found["img"] == [{"src": "poster.jpg", "alt": ""}]


def _find_meta(page):
    return {it["property"]: it["content"] for it in page.found["meta"] if "property" in it}


def test_a_link_preview_has_the_full_url_of_the_poster():
    page = _read(PageOptions("Steak"), has_poster=True, url="https://example.org/steak/")

    assert _find_meta(page) == {
        "og:type": "website",
        "og:title": "Steak",
        "og:image": "https://example.org/steak/poster.jpg",
    }
    assert "og:image" not in _find_meta(_read(PageOptions("Steak"), has_poster=True))


def test_an_iframe_shows_a_page():
    frame = Elements(build_iframe('A "title"', "https://example.org/?a&b", 960, 640)).found[
        "iframe"
    ]

    assert frame == [
        {
            "src": "https://example.org/?a&b",
            "title": 'A "title"',
            "width": "960",
            "height": "640",
            "style": "border: 0; max-width: 100%",
            "allow": "autoplay; fullscreen",
        }
    ]


def test_the_player_is_a_module_that_defines_the_component():
    assert b"quarc-player" in read_player()
