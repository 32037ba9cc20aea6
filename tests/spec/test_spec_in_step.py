"""SPEC.md and the code agree: a change of one requires a change of the other."""

import re

import pytest

from plain import clauses, spec_text
from quarc_ref.format import constants, layouts, wire
from quarc_ref.format.records import StreamHeader
from tests.spec import check_annexes, check_ranges, check_tables

CHECKS = (
    *check_tables.CHECKS,
    *check_ranges.CHECKS,
    *clauses.CHECKS,
    *check_annexes.CHECKS,
)


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
def test_the_specification_agrees_with_the_code(check):
    check(spec_text.read_spec())


@pytest.mark.parametrize("name", ["A", "B", "C", "D"])
def test_the_dumps_of_annex_g_are_the_streams(name):
    check_annexes.check_dump(name, spec_text.read_dump(name))


def test_every_section_that_the_code_names_exists():
    sections, missing = spec_text.list_section_numbers(spec_text.read_spec()), {}
    for folder in ("quarc_ref", "tests"):
        for path in sorted((spec_text.ROOT / folder).rglob("*.py")):
            unknown = set(spec_text.find_section_references(path.read_text("utf-8"))) - sections
            if unknown:
                missing[path.name] = unknown

    assert missing == {}


def test_the_sizes_of_fixed_parts_match_the_specification():
    assert layouts.CHUNK_HEADER.sizeof() == constants.CHUNK_HEADER_BYTES
    match = re.search(r"The payload of HEAD has (\d+) bytes", spec_text.read_spec())
    assert len(wire.build_stream_header(StreamHeader())) == int(match[1])
    assert layouts.SECTION.build({"word_count": 0, "words": b""}) == bytes(
        constants.SECTION_HEADER_BYTES
    )


def test_no_line_of_the_specification_is_longer_than_125():
    tables = ("|", "    ", "<!--")
    lines = spec_text.read_spec().splitlines()

    assert [line for line in lines if len(line) > 125 and not line.startswith(tables)] == []
