"""Reads SPEC.md: its marked tables, its sections, its reject ids."""

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


@cache
def text() -> str:
    return (ROOT / "SPEC.md").read_text("utf-8")


def table(marker: str) -> list[list[str]]:
    """The rows of the table under `<!-- spec:marker -->`, without its head."""
    _, after = text().split(f"<!-- spec:{marker} -->\n", 1)
    lines = after.split("\n\n", 1)[0].splitlines()
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def sections() -> set[str]:
    """The numbers of all sections: `5`, `5.3` and so on."""
    return set(re.findall(r"^#{2,3} (\d+(?:\.\d+)?) ", text(), re.MULTILINE))


def section_references(source: str) -> list[str]:
    """The numbers behind `SPEC ` in a source file; of `SPEC 6.1 to 6.3` all three that are said."""
    found = []
    for numbers in re.findall(r"SPEC (\d[\d., to and]*)", source):
        found += re.findall(r"\d+(?:\.\d+)?", numbers)
    return found
