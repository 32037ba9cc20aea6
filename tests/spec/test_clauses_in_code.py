"""Every clause for decoders is named by its id where the reference engine implements it."""

import re

from plain import spec_text
from plain.clauses import parse_clauses

# Clauses that the whole decoder implements, and no particular line.
_GENERAL_CLAUSES = {"1-1", "1-2", "1-3"}
_ENCODER_CLAUSES = {"1-4"}
_FOLDERS = ("quarc_ref/format", "quarc_ref/decoder", "quarc_ref/streams")


def _list_named_clauses():
    """Return the clause ids in comments of the reference engine."""
    files = [path for folder in _FOLDERS for path in (spec_text.ROOT / folder).rglob("*.py")]
    comments = [
        comment for path in files for comment in re.findall(r"#.*", path.read_text("utf-8"))
    ]
    return {name for comment in comments for name in re.findall(r"\[([\d.]+-\d+)\]", comment)}


def test_every_clause_for_decoders_is_named_in_the_code():
    clause_ids = {clause.number for clause in parse_clauses(spec_text.read_spec())}

    assert clause_ids - _GENERAL_CLAUSES - _ENCODER_CLAUSES - _list_named_clauses() == set()


def test_the_code_names_only_existing_clauses():
    clause_ids = {clause.number for clause in parse_clauses(spec_text.read_spec())}

    assert _list_named_clauses() - clause_ids == set()
