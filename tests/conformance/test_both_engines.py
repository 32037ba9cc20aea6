"""Tests both engines with the main categories; `make conformance` runs all vectors."""

from pathlib import Path

import pytest

from quarc_ref.conformance.jobs import CAPABILITIES, answer_job
from quarc_ref.decoder.engines import use_engine
from runner.cases import list_cases
from runner.judge import PASS, judge
from runner.manifest import Suite
from tests.engines import engines

SUITE = Suite.load(Path(__file__).resolve().parents[2] / "conformance")
TESTED_MODES = ("decode", "unit")
CASES = [case for case in list_cases(SUITE, CAPABILITIES) if case.mode in TESTED_MODES]


@pytest.mark.parametrize("category", ["unit", "streams", "traps", "invalid"])
@engines
def test_every_case_of_a_category_passes(category, engine):
    failures = {}
    for case in (case for case in CASES if case.category == category):
        stream = b"" if case.mode == "unit" else SUITE.read_stream(case.vector)
        with use_engine(engine):
            verdict = judge(case, list(answer_job(case.job, stream)))
        if verdict.name != PASS:
            failures[case.name] = verdict

    assert failures == {}


def test_every_claim_of_the_suite_is_covered():
    functions = {unit["function"] for unit in SUITE.units}

    assert functions == set(CAPABILITIES["units"])
