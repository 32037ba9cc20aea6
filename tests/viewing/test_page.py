from html.parser import HTMLParser

import pytest

from quarc_ref.viewing.page import PageAudio, PageOptions, build_iframe, build_page, read_player


class PageElements(HTMLParser):
    """Collects the attributes of all elements of a page, and the title."""

    def __init__(self, text):
        super().__init__()
        self.attributes, self.title, self._open = {}, "", None
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.attributes.setdefault(tag, []).append(dict(attrs))
        self._open = tag

    def handle_data(self, data):
        if self._open == "title":
            self.title += data.strip()


def _build_and_parse(options, **page_options):
    return PageElements(build_page(options, **page_options).decode())


def test_the_player_has_the_requested_attributes():
    page = _build_and_parse(
        PageOptions("t", camera="cam03", up="-y", autoplay=True, loop=True, live=True)
    )

    assert page.attributes["quarc-player"] == [
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
    assert _build_and_parse(PageOptions("t")).attributes["quarc-player"] == [
        {"src": "stream.quarc"}
    ]


@pytest.mark.parametrize(
    ("start", "attribute"),
    [(0.0, {}), (1e-9, {}), (2.0, {"audio-start": "2.0"}), (-1 / 3, {"audio-start": "-0.333"})],
)
def test_the_player_knows_the_audio_and_its_start(start, attribute):
    audio = PageAudio(b"", "audio.mp3", "audio/mpeg", start)

    assert _build_and_parse(PageOptions("t", audio=audio)).attributes["quarc-player"] == [
        {"src": "stream.quarc", "audio": "audio.mp3", **attribute}
    ]


@pytest.mark.parametrize(
    "text", ['"><script>alert(1)</script>', "a & b", "'quoted'", "$title ${x}"]
)
def test_text_is_escaped(text):
    page = _build_and_parse(PageOptions(text, camera=text))

    assert page.title == text
    assert page.attributes["quarc-player"][0]["camera"] == text
    assert len(page.attributes["script"]) == 2


def test_a_poster_is_a_picture_that_the_script_passes_to_the_player():
    page = _build_and_parse(PageOptions("t"), has_poster=True)

    assert "poster" not in page.attributes["quarc-player"][0]
    assert page.attributes["img"] == [{"src": "poster.jpg", "alt": ""}]


def _find_meta(page):
    return {
        element["property"]: element["content"]
        for element in page.attributes["meta"]
        if "property" in element
    }


def test_a_link_preview_has_the_full_url_of_the_poster():
    page = _build_and_parse(PageOptions("Steak"), has_poster=True, url="https://example.org/steak/")

    assert _find_meta(page) == {
        "og:type": "website",
        "og:title": "Steak",
        "og:image": "https://example.org/steak/poster.jpg",
    }
    assert "og:image" not in _find_meta(_build_and_parse(PageOptions("Steak"), has_poster=True))


def test_an_iframe_shows_a_page():
    frame = PageElements(
        build_iframe('A "title"', "https://example.org/?a&b", 960, 640)
    ).attributes["iframe"]

    assert frame == [
        {
            "src": "https://example.org/?a&b",
            "title": 'A "title"',
            "width": "960",
            "height": "640",
            "style": "border: 0; max-width: 100%",
            "allow": "autoplay; fullscreen; xr-spatial-tracking",
        }
    ]


def test_the_player_is_a_module_that_defines_the_component():
    assert b"quarc-player" in read_player()
