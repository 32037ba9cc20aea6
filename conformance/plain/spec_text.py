"""Reads SPEC.md: its marked tables, its sections, its generated regions.

Every function takes the text, so that checks can be tested on texts with a mistake.
"""

import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SPEC = ROOT / "SPEC.md"


@cache
def text() -> str:
    return SPEC.read_text("utf-8")


def lines_of(spec: str, marker: str) -> list[str]:
    """The lines below `<!-- spec:marker -->` up to the first empty one."""
    parts = spec.split(f"<!-- spec:{marker} -->\n")
    assert len(parts) == 2, f"spec:{marker} is there {len(parts) - 1} times"
    return parts[1].split("\n\n", 1)[0].splitlines()


def cells_of(line: str) -> list[str]:
    return [cell.strip() for cell in line.strip().strip("|").split("|")]


def table(spec: str, marker: str) -> list[list[str]]:
    """The rows of the table below a marker, without its header."""
    head, rule, *rows = [cells_of(line) for line in lines_of(spec, marker)]
    assert all(set(cell) == {"-"} for cell in rule), marker
    assert all(len(row) == len(head) for row in rows), marker
    return rows


def records(spec: str, marker: str) -> list[dict[str, str]]:
    """The rows of a table by the names in its header."""
    head = cells_of(lines_of(spec, marker)[0])
    return [dict(zip(head, row, strict=True)) for row in table(spec, marker)]


def made(spec: str, name: str) -> str:
    """The content between the comments of a region that `make_annexes` writes."""
    begin, end = f"<!-- made:{name} -->\n", f"<!-- end:{name} -->"
    assert spec.count(begin) == spec.count(end) == 1, name
    return spec.split(begin)[1].split(end)[0]


def replace_region(spec: str, name: str, body: str) -> str:
    """The text with other content between the comments of a region."""
    old = made(spec, name)
    begin = f"<!-- made:{name} -->\n"
    return spec.replace(begin + old, begin + body, 1)


def dump_path(name: str) -> str:
    """Path of the dump of a stream of Annex G in the repository."""
    return f"conformance/annex-g/stream-{name}.hex"


@cache
def dump(name: str) -> bytes:
    """The bytes of a stream of Annex G."""
    return parse_dump((ROOT / dump_path(name)).read_text("utf-8"))


def parse_dump(dump: str) -> bytes:
    """The bytes of lines such as `00000010: 89 51 ...`."""
    data = b""
    for line in dump.splitlines():
        offset, digits = line.split(":")
        assert int(offset, 16) == len(data), f"offset {offset}"
        data += bytes.fromhex(digits)
    return data


def section(spec: str, number: str) -> str:
    """The text of a section, up to the next heading."""
    found = re.search(rf"^### {re.escape(number)} .*?(?=^##)", spec, re.MULTILINE | re.DOTALL)
    assert found, number
    return found[0]


def sections(spec: str) -> set[str]:
    """The numbers of all sections: `5`, `5.3`, `F.7` and so on."""
    numbers = re.findall(r"^#{2,3} (\d+(?:\.\d+)?|[A-Z]\.\d+) ", spec, re.MULTILINE)
    return {*numbers, *re.findall(r"^## Annex ([A-Z]):", spec, re.MULTILINE)}


def section_references(source: str) -> list[str]:
    """The numbers after `SPEC ` in a source file; of `SPEC 6.1 to 6.3` all three."""
    found = []
    for numbers in re.findall(r"SPEC (\d[\d., to and]*)", source):
        found += re.findall(r"\d+(?:\.\d+)?", numbers)
    return found
