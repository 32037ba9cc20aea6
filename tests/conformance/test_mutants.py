"""Tests that the mutants apply to the current decoder, and that their verdicts are correct."""

from pathlib import Path

import pytest

from mutant import Mutant
from mutants import MUTANTS
from run_mutants import (
    CATEGORIES,
    Outcome,
    copy_with_mutant,
    describe_outcome,
    main,
    summarize_categories,
    try_mutant,
)
from runner.limits import Limits
from runner.manifest import Suite

ROOT = Path(__file__).resolve().parents[2]
MIN_MUTANTS = 20


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_every_text_to_replace_occurs_exactly_once(mutant):
    for file, old_text, new_text in mutant.edits:
        source = (ROOT / "quarc_ref" / file).read_text("utf-8")

        assert source.count(old_text) == 1, old_text
        assert compile(source.replace(old_text, new_text), file, "exec")


def test_there_are_many_mutants_and_one_specific_to_each_category():
    assert len(MUTANTS) >= MIN_MUTANTS
    assert {mutant.only_category for mutant in MUTANTS} - {""} == set(CATEGORIES)


def test_a_mutant_that_does_not_apply_is_an_error(tmp_path):
    mutant = Mutant("stray", (("format/coding/ans.py", "no such text", ""),))

    with pytest.raises(ValueError, match="0 times"):
        copy_with_mutant(mutant, ROOT / "quarc_ref", tmp_path)


def test_an_empty_selection_fails(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["run_mutants.py", "--only", "nothing"])

    with pytest.raises(SystemExit, match="2"):
        main()
    assert "--only nothing: no name of a mutant contains this" in capsys.readouterr().err


def test_a_surviving_mutant_is_reported_and_fails():
    outcome = Outcome(Mutant("quiet", ()), {})

    assert "SURVIVES" in describe_outcome(outcome)
    assert summarize_categories([outcome])[1] is False


def test_a_mutant_that_crashes_on_a_valid_stream_is_broken_and_not_detected():
    edit = ("streams/chunk_reader.py", "if header.sequence != self.sequence:", "if no_such_name:")
    suite = Suite.load(ROOT / "conformance")

    outcome = try_mutant(Mutant("typo", (edit,)), ROOT / "quarc_ref", suite, Limits(60, 512), 1)

    assert outcome.first_failures == {}
    assert describe_outcome(outcome).startswith("typo: BROKEN, streams/still: crash: ")
    assert "no_such_name" in outcome.crash
    summary, is_as_expected = summarize_categories([outcome])
    assert summary.endswith("0 of 1 mutants detected, 1 broken")
    assert not is_as_expected


def test_an_unneeded_category_fails():
    mutant = Mutant("lonely", (), only_category="traps")

    assert summarize_categories([Outcome(mutant, {"traps": "a"})])[1] is True
    assert summarize_categories([Outcome(mutant, {"traps": "a", "unit": "b"})])[1] is False
    assert summarize_categories([Outcome(mutant, {"unit": "b"})])[1] is False
