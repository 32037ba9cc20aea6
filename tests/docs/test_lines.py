"""Lines of Markdown fit into an editor: outside tables, code and links."""

import re

import pytest

from tests.docs.pages import FENCE, ROOT

MAX_LENGTH = 140
FOLDERS = ("benchmarks", "conformance", "core", "decoders", "docs", "player", "requirements")
BUILT = {"node_modules", "target", "api", "build"}
PAGES = [
    *ROOT.glob("*.md"),
    *(
        page
        for folder in FOLDERS
        for page in (ROOT / folder).rglob("*.md")
        if not BUILT & set(page.relative_to(ROOT).parts)
    ),
]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_lines_are_short(page):
    text = FENCE.sub("", page.read_text("utf-8"))
    lines = re.sub(r"\]\([^)]*\)|https?:\S+", "", text).splitlines()

    assert [line for line in lines if len(line) > MAX_LENGTH and line.lstrip()[0] != "|"] == []


def test_pages_are_found():
    assert len(PAGES) > 30
