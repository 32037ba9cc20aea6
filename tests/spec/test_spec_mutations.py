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
    """Yield texts in which one line of a marked block is replaced."""
    start, end = _block(TEXT, marker)
    lines = TEXT[start:end].split("\n")
    for number, line in enumerate(lines[3:], 3):
        for new_line in mutate(line):
            new_lines = [*lines[:number], *([new_line] if new_line else []), *lines[number + 1 :]]
            yield TEXT[:start] + "\n".join(new_lines) + TEXT[end:]


def _increase_a_number(line: str) -> Iterator[str]:
    """Yield the line once per number, with this number increased by 1."""
    for match in re.finditer(r"(?<![\w.-])\d+(?![\w.])", line):
        yield line[: match.start()] + str(int(match[0]) + 1) + line[match.end() :]


def _change_name(line: str) -> Iterator[str]:
    yield line.replace("| ", "| x", 1)
    yield ""


def _change_type(line: str) -> Iterator[str]:
    name, kind, *rest = spec_text.split_table_row(line)
    other_types = {"u8": "u16", "u16": "u8", "u32": "i32", "i32": "u32", "u64": "u32", "f32": "u32"}
    yield f"| {name} | {other_types.get(kind, 'u8')} | {' | '.join(rest)} |"


def _change_cell(line: str) -> Iterator[str]:
    """Yield the row once per cell, with the last letter of this cell changed."""
    cells = spec_text.split_table_row(line)
    for i, cell in enumerate(cells):
        new_cell = cell[:-1] + ("1" if cell[-1:] != "1" else "2")
        yield "| " + " | ".join([*cells[:i], new_cell, *cells[i + 1 :]]) + " |"


def _count_undetected(texts: Iterator[str], check: Check) -> tuple[int, int]:
    """Return the number of tested texts, and the number of texts that the check accepted."""
    tested = undetected = 0
    for text in texts:
        tested += 1
        try:
            check(text)
        except Exception:
            continue
        undetected += 1
    return tested, undetected


def _expect_detection(texts: Iterator[str], check: Check, at_least: int) -> None:
    tested, undetected = _count_undetected(texts, check)

    assert undetected == 0
    assert tested >= at_least


@pytest.mark.parametrize("mutate", [_increase_a_number, _change_name])
def test_a_wrong_constant_is_detected(mutate):
    def change_value(line: str) -> Iterator[str]:
        name, value, meaning = spec_text.split_table_row(line)
        for new_cells in mutate(f"| {name} | {value} |"):
            yield f"{new_cells} {meaning} |" if new_cells else new_cells

    _expect_detection(_mutate_lines("constants", change_value), check_tables.check_constants, 38)


@pytest.mark.parametrize("mutate", [_increase_a_number, _change_name])
def test_a_wrong_level_is_detected(mutate):
    _expect_detection(_mutate_lines("levels", mutate), check_tables.check_levels, 8)


def test_a_wrong_reject_id_is_detected():
    _expect_detection(_mutate_lines("rejects", _change_name), check_tables.check_rejects, 58)


@pytest.mark.parametrize("name", check_tables.SYNTAX)
@pytest.mark.parametrize("mutate", [_change_name, _change_type])
def test_a_wrong_row_of_syntax_is_detected(name, mutate):
    _expect_detection(_mutate_lines(f"syntax {name}", mutate), check_tables.check_syntax, 2)


@pytest.mark.parametrize("name", ["STREAM_HEADER", "CANONICAL", "FRAME"])
def test_a_wrong_range_is_detected(name):
    def change_range(line: str) -> Iterator[str]:
        field, kind, range_text, meaning = spec_text.split_table_row(line)
        new_ranges = (
            _increase_a_number(range_text)
            if range_text and not range_text.startswith("of")
            else iter(())
        )
        for new_range in new_ranges:
            yield f"| {field} | {kind} | {new_range} | {meaning} |"
        if range_text:
            yield f"| {field} | {kind} | | {meaning} |"

    _expect_detection(_mutate_lines(f"syntax {name}", change_range), check_ranges.check_ranges, 2)


def test_a_wrong_number_in_a_formula_is_detected():
    def change_digits() -> Iterator[str]:
        for number in ("6.2", "4.5"):
            section = spec_text.read_section(TEXT, number)
            for match in re.finditer("0x[0-9A-F]{7}", section):
                digit = "1" if section[match.end()] != "1" else "2"
                yield TEXT.replace(
                    section, section[: match.end()] + digit + section[match.end() + 1 :]
                )

    _expect_detection(change_digits(), check_tables.check_formulas, 10)


def test_swapped_rows_of_syntax_are_detected():
    def swap_rows() -> Iterator[str]:
        for name in check_tables.SYNTAX:
            start, end = _block(TEXT, f"syntax {name}")
            lines = TEXT[start:end].split("\n")
            for i in range(3, len(lines) - 1):
                new_lines = [*lines[:i], lines[i + 1], lines[i], *lines[i + 2 :]]
                yield TEXT[:start] + "\n".join(new_lines) + TEXT[end:]

    _expect_detection(swap_rows(), check_tables.check_syntax, 50)


@pytest.mark.parametrize("name", [table.marker for table in TABLES])
def test_a_wrong_known_answer_is_detected(name):
    def change_answer(line: str) -> Iterator[str]:
        *cells, answer = spec_text.split_table_row(line)
        new_answer = answer[:-1] + ("1" if answer[-1] != "1" else "2")
        yield f"| {' | '.join(cells)} | {new_answer} |"

    _expect_detection(
        _mutate_lines(f"vectors {name}", change_answer), check_annexes.check_vectors, 3
    )


@pytest.mark.parametrize(
    "name",
    ["widths", "vectors codes", "fields A", "digests C", "planes A0", "state B3", "notes B3"],
)
def test_a_wrong_cell_of_a_generated_table_is_detected(name):
    _expect_detection(_mutate_lines(name, _change_cell), check_annexes.check_regions, 6)


def test_a_clause_without_id_and_an_id_without_clause_are_detected():
    ids = list(re.finditer(r" \[(?:\d+(?:\.\d+)?)-\d+\]", TEXT))
    texts_without_id = (TEXT[: match.start()] + TEXT[match.end() :] for match in ids)
    words = re.finditer(r'(?<!")\bMUST\b(?! NOT"|")', TEXT)
    texts_without_must = (
        TEXT[: match.start()] + "ought to" + TEXT[match.end() :] for match in words
    )

    _expect_detection(texts_without_id, clauses.check_clause_ids, 40)
    _expect_detection(texts_without_must, clauses.check_clause_ids, 40)


def test_a_clause_with_another_reject_id_is_detected():
    matches = re.finditer(r"\(`([a-z]+(?:-[a-z]+)*)`\) \[", TEXT)
    wrong_texts = (
        TEXT[: match.start(1)] + "no-such-id" + TEXT[match.end(1) :] for match in matches
    )

    _expect_detection(wrong_texts, clauses.check_reject_ids_of_clauses, 20)


def test_a_broken_link_or_reference_is_detected():
    links = re.finditer(r"\]\(#", TEXT)
    references = re.finditer(r"(?<!\d, )\b(?:section |Annex [A-J]\.)\d+", TEXT)

    _expect_detection(
        (TEXT[: n.end()] + "x" + TEXT[n.end() :] for n in links), clauses.check_links, 20
    )
    _expect_detection(
        (TEXT[: n.end()] + "77" + TEXT[n.end() :] for n in references),
        clauses.check_references,
        20,
    )
