"""Common parts of all HTML pages: style, tables, embedded pictures."""

import base64
import html
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from string import Template


def fill_page(template: str, parts: Mapping[str, str]) -> bytes:
    """Fill the template of a page.

    Args:
        template: HTML with a placeholder `$name` for every part, and `$skin` for the style sheet.
        parts: HTML of the parts by name.
    """
    skin = resources.files(__package__).joinpath("skin.css").read_text("utf-8")
    page = Template(template).substitute(parts, skin=skin)
    return page.encode(errors="replace")  # the name of a file may be no valid UTF-8


def format_lines(values: Mapping[str, object]) -> str:
    """Format names and values as HTML, one pair per line."""
    return format_texts(f"{name}: {value}" for name, value in values.items())


def format_texts(texts: Iterable[str]) -> str:
    """Format texts as HTML, one per line."""
    return "<p><code>" + "<br>".join(map(html.escape, texts)) + "</code></p>"


def format_table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Format rows of plain-text cells as an HTML table."""
    head = "".join(f"<th>{html.escape(heading)}</th>" for heading in headings)
    lines = ["".join(f"<td>{html.escape(cell)}</td>" for cell in row) for row in rows]
    return f"<table><tr>{head}</tr>{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"


def embed_png(png: bytes) -> str:
    """Return a data URL that contains a PNG picture."""
    return "data:image/png;base64," + base64.b64encode(png).decode()
