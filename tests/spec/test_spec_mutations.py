"""A mistake in SPEC.md alone fails a check: every number, name and byte is tested.

Each mutation is made in memory, and the check of that part must fail. The checks of the real text
are in `test_spec_in_step`.
"""

import re
from collections.abc import Callable, Iterator

import pytest

from plain import clauses, spec_text
from tests.spec import check_annexes, check_ranges, check_tables
from tests.spec.vector_tables import TABLES

Check = Callable[[str], None]
TEXT = spec_text.read_spec()


def _block(spec: str, marker: str) -> tuple[int, int]:
    start = spec.index(f"<!-- spec:{marker} -->\n")
    return start, spec.index("\n\n", start)


def _mutate_lines(marker: str, mutate: Callable[[str], Iterator[str]]) -> Iterator[str]:
    """Texts in which one line of a marked block is replaced."""
    start, end = _block(TEXT, marker)
    lines = TEXT[start:end].split("\n")
    for number, line in enumerate(lines[3:], 3):
        for other in mutate(line):
            changed = [*lines[:number], *([other] if other else []), *lines[number + 1 :]]
            yield TEXT[:start] + "\n".join(changed) + TEXT[end:]


def _next_number(line: str) -> Iterator[str]:
    """The line with one of its numbers, each in turn, increased by 1."""
    for match in re.finditer(r"(?<![\w.-])\d+(?![\w.])", line):
        yield line[: match.start()] + str(int(match[0]) + 1) + line[match.end() :]


def _other_name(line: str) -> Iterator[str]:
    yield line.replace("| ", "| x", 1)
    yield ""


def _other_type(line: str) -> Iterator[str]:
    name, kind, *rest = spec_text.table_cells(line)
    others = {"u8": "u16", "u16": "u8", "u32": "i32", "i32": "u32", "u64": "u32", "f32": "u32"}
    yield f"| {name} | {others.get(kind, 'u8')} | {' | '.join(rest)} |"


def _other_cell(line: str) -> Iterator[str]:
    """A row with one of its cells, each in turn, changed in its last letter."""
    cells = spec_text.table_cells(line)
    for i, cell in enumerate(cells):
        other = cell[:-1] + ("1" if cell[-1:] != "1" else "2")
        yield "| " + " | ".join([*cells[:i], other, *cells[i + 1 :]]) + " |"


def _count_slips_that_pass(texts: Iterator[str], check: Check) -> tuple[int, int]:
    """How many texts were tested, and how many of them the check accepted."""
    tried = passed = 0
    for text in texts:
        tried += 1
        try:
            check(text)
        except Exception:
            continue
        passed += 1
    return tried, passed


def _expect_red(texts: Iterator[str], check: Check, at_least: int) -> None:
    tried, passed = _count_slips_that_pass(texts, check)

    assert passed == 0
    assert tried >= at_least


@pytest.mark.parametrize("mutate", [_next_number, _other_name])
def test_a_wrong_constant_is_detected(mutate):
    def values(line: str) -> Iterator[str]:
        name, value, meaning = spec_text.table_cells(line)
        for other in mutate(f"| {name} | {value} |"):
            yield f"{other} {meaning} |" if other else other

    _expect_red(_mutate_lines("constants", values), check_tables.check_constants, 38)


@pytest.mark.parametrize("mutate", [_next_number, _other_name])
def test_a_wrong_level_is_detected(mutate):
    _expect_red(_mutate_lines("levels", mutate), check_tables.check_levels, 8)


def test_a_wrong_reject_id_is_detected():
    _expect_red(_mutate_lines("rejects", _other_name), check_tables.check_rejects, 58)


@pytest.mark.parametrize("name", check_tables.SYNTAX)
@pytest.mark.parametrize("mutate", [_other_name, _other_type])
def test_a_wrong_row_of_syntax_is_detected(name, mutate):
    _expect_red(_mutate_lines(f"syntax {name}", mutate), check_tables.check_syntax, 2)


@pytest.mark.parametrize("name", ["STREAM_HEADER", "CANONICAL", "FRAME"])
def test_a_wrong_range_is_detected(name):
    def ranges(line: str) -> Iterator[str]:
        field, kind, message, meaning = spec_text.table_cells(line)
        others = _next_number(message) if message and not message.startswith("of") else iter(())
        for other in others:
            yield f"| {field} | {kind} | {other} | {meaning} |"
        if message:
            yield f"| {field} | {kind} | | {meaning} |"

    _expect_red(_mutate_lines(f"syntax {name}", ranges), check_ranges.check_ranges, 2)


def test_a_wrong_number_in_a_formula_is_detected():
    def others() -> Iterator[str]:
        for number, digits in (
            ("6.2", "0x[0-9A-F]{7}"),
            ("4.5", "0x[0-9A-F]{7}"),
            ("10.2", r"\.\d{5}"),
        ):
            section = spec_text.read_section(TEXT, number)
            for found in re.finditer(digits, section):
                digit = "1" if section[found.end()] != "1" else "2"
                yield TEXT.replace(
                    section, section[: found.end()] + digit + section[found.end() + 1 :]
                )

    _expect_red(others(), check_tables.check_formulas, 12)


def test_swapped_rows_of_syntax_are_detected():
    def swapped() -> Iterator[str]:
        for name in check_tables.SYNTAX:
            start, end = _block(TEXT, f"syntax {name}")
            lines = TEXT[start:end].split("\n")
            for i in range(3, len(lines) - 1):
                other = [*lines[:i], lines[i + 1], lines[i], *lines[i + 2 :]]
                yield TEXT[:start] + "\n".join(other) + TEXT[end:]

    _expect_red(swapped(), check_tables.check_syntax, 50)


@pytest.mark.parametrize("name", ["A", "B", "C"])
def test_a_wrong_byte_of_a_dump_is_detected(name):
    data = spec_text.read_dump(name)
    for place in range(len(data)):
        other = bytes([*data[:place], data[place] ^ 1, *data[place + 1 :]])
        with pytest.raises(AssertionError):
            check_annexes.check_dump(name, other)


@pytest.mark.parametrize("name", ["A", "B", "C"])
def test_a_wrong_cell_of_the_fields_is_detected(name):
    _expect_red(_mutate_lines(f"fields {name}", _other_cell), check_annexes.check_regions, 300)


@pytest.mark.parametrize("name", ["A", "B", "C"])
def test_a_wrong_digest_or_number_of_a_frame_is_detected(name):
    _expect_red(_mutate_lines(f"digests {name}", _other_cell), check_annexes.check_regions, 6)


@pytest.mark.parametrize("name", [table.marker for table in TABLES])
def test_a_wrong_known_answer_is_detected(name):
    def answers(line: str) -> Iterator[str]:
        *cells, answer = spec_text.table_cells(line)
        other = answer[:-1] + ("1" if answer[-1] != "1" else "2")
        yield f"| {' | '.join(cells)} | {other} |"

    _expect_red(_mutate_lines(f"vectors {name}", answers), check_annexes.check_vectors, 3)


@pytest.mark.parametrize("name", ["widths", "vectors codes", "planes A0", "state B3", "notes B3"])
def test_a_wrong_cell_of_a_generated_table_is_detected(name):
    _expect_red(_mutate_lines(name, _other_cell), check_annexes.check_regions, 12)


def test_a_clause_without_id_and_an_id_without_clause_are_detected():
    ids = list(re.finditer(r" \[(?:\d+(?:\.\d+)?)-\d+\]", TEXT))
    without = (TEXT[: found.start()] + TEXT[found.end() :] for found in ids)
    words = re.finditer(r'(?<!")\bMUST\b(?! NOT"|")', TEXT)
    weaker = (TEXT[: found.start()] + "ought to" + TEXT[found.end() :] for found in words)

    _expect_red(without, clauses.check_clause_ids, 40)
    _expect_red(weaker, clauses.check_clause_ids, 40)


def test_a_clause_with_another_reject_id_is_detected():
    named = re.finditer(r"\(`([a-z]+(?:-[a-z]+)*)`\) \[", TEXT)
    wrong = (TEXT[: n.start(1)] + "no-such-id" + TEXT[n.end(1) :] for n in named)

    _expect_red(wrong, clauses.check_reject_ids_of_clauses, 20)


def test_a_broken_link_or_reference_is_detected():
    links = re.finditer(r"\]\(#", TEXT)
    references = re.finditer(r"(?<!\d, )\b(?:section |Annex [A-J]\.)\d+", TEXT)

    _expect_red((TEXT[: n.end()] + "x" + TEXT[n.end() :] for n in links), clauses.check_links, 20)
    _expect_red(
        (TEXT[: n.end()] + "77" + TEXT[n.end() :] for n in references),
        clauses.check_references,
        20,
    )
