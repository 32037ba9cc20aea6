"""Reads SPEC.md: tables below markers, sections, and generated regions.

Most functions take the text as an argument, so that tests can pass a text with a mistake in it.
"""

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SPEC = ROOT / "SPEC.md"


@cache
def read_spec() -> str:
    return SPEC.read_text("utf-8")


def read_table_lines(spec: str, marker: str) -> list[str]:
    """Return the lines between `<!-- spec:marker -->` and the next empty line."""
    parts = spec.split(f"<!-- spec:{marker} -->\n")
    assert len(parts) == 2, f"spec:{marker} occurs {len(parts) - 1} times, expected once"
    return parts[1].split("\n\n", 1)[0].splitlines()


def split_table_row(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def read_table(spec: str, marker: str) -> list[list[str]]:
    """Return the rows of the table below a marker, without the header."""
    header, separator, *rows = [split_table_row(line) for line in read_table_lines(spec, marker)]
    assert all(set(cell) == {"-"} for cell in separator), marker
    assert all(len(row) == len(header) for row in rows), marker
    return rows


def read_records(spec: str, marker: str) -> list[dict[str, str]]:
    """Return the rows of the table below a marker, as dicts by column name."""
    header = split_table_row(read_table_lines(spec, marker)[0])
    return [dict(zip(header, row, strict=True)) for row in read_table(spec, marker)]


def read_generated_region(spec: str, name: str) -> str:
    """Return the content of a region that `make_annexes` writes, without its enclosing comments."""
    begin, end = f"<!-- made:{name} -->\n", f"<!-- end:{name} -->"
    assert spec.count(begin) == spec.count(end) == 1, name
    return spec.split(begin)[1].split(end)[0]


def replace_region(spec: str, name: str, body: str) -> str:
    """Return the text with the content of a generated region replaced by `body`."""
    old_body = read_generated_region(spec, name)
    begin = f"<!-- made:{name} -->\n"
    return spec.replace(begin + old_body, begin + body, 1)


def make_dump_path(name: str) -> str:
    """Return the path of the hex dump of a stream of Annex G, relative to the repository."""
    return f"conformance/annex-g/stream-{name}.hex"


@cache
def read_dump(name: str) -> bytes:
    """Return the bytes of a stream of Annex G, from its hex dump."""
    return parse_dump((ROOT / make_dump_path(name)).read_text("utf-8"))


def parse_dump(dump: str) -> bytes:
    """Return the bytes of a hex dump with lines such as `00000010: 89 51 ...`."""
    data = b""
    for line in dump.splitlines():
        offset, digits = line.split(":")
        assert int(offset, 16) == len(data), f"offset {offset}"
        data += bytes.fromhex(digits)
    return data


def read_section(spec: str, number: str) -> str:
    """Return the text of a section, up to the next heading."""
    match = re.search(rf"^### {re.escape(number)} .*?(?=^##)", spec, re.MULTILINE | re.DOTALL)
    assert match, number
    return match[0]


def list_section_numbers(spec: str) -> set[str]:
    """Return the numbers of all sections, such as `5`, `5.3` or `F.7`."""
    numbers = re.findall(r"^#{2,3} (\d+(?:\.\d+)?|[A-Z]\.\d+) ", spec, re.MULTILINE)
    return {*numbers, *re.findall(r"^## Annex ([A-Z]):", spec, re.MULTILINE)}


def find_section_references(source: str) -> list[str]:
    """Return the section numbers cited after `SPEC ` in source text; for a range, its two ends."""
    references = []
    for numbers in re.findall(r"SPEC (\d[\d., to and]*)", source):
        references += re.findall(r"\d+(?:\.\d+)?", numbers)
    return references
