"""Every clause for decoders is named by its id where the reference engine implements it."""

import re

from plain import spec_text
from plain.clauses import parse_clauses

# Implemented by the decoder as a whole, not by a particular line.
_WHOLE = {"1-1", "1-2", "1-3"}
_OF_ENCODERS = {"1-4"}
_CODE = ("quarc_ref/format", "quarc_ref/decoder", "quarc_ref/streams")


def _named():
    """The ids in comments of the reference engine."""
    files = [path for folder in _CODE for path in (spec_text.ROOT / folder).rglob("*.py")]
    comments = [
        comment for path in files for comment in re.findall(r"#.*", path.read_text("utf-8"))
    ]
    return {name for comment in comments for name in re.findall(r"\[([\d.]+-\d+)\]", comment)}


def test_every_clause_for_decoders_is_named_in_the_code():
    known = {clause.number for clause in parse_clauses(spec_text.read_spec())}

    assert known - _WHOLE - _OF_ENCODERS - _named() == set()


def test_the_code_names_only_existing_clauses():
    known = {clause.number for clause in parse_clauses(spec_text.read_spec())}

    assert _named() - known == set()
