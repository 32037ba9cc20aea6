"""Tests all readers of streams with mutated streams: sources, recovery, verbs."""

import io
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hostile.mutations import Mutator
from quarc_ref.decoder import compute_digest
from quarc_ref.decoder.engine import FAST, REFERENCE
from quarc_ref.decoder.engines import use_engine
from quarc_ref.format.errors import BitstreamError, LimitError
from quarc_ref.streams import Gap, PipeSource, decode, recover
from quarc_ref.streams.http_source import HttpSource
from tests.cli.commands import run
from tests.engines import needs_fast
from tests.streams.hostile_servers import serve_data

_SEEDS = {
    path.stem: path.read_bytes()
    for path in (Path(__file__).parent / "seeds" / "streams").glob("*.quarc")
}
_MUTATOR = Mutator(_SEEDS, series=11)
_MUTANTS = st.integers(0, 1 << 40).map(lambda number: _MUTATOR.make(number).data)


def _summarize(stream):
    """Return the digest of every frame of a stream, and the reject id and offset of an error."""
    results = []
    try:
        for scene in decode(stream):
            results.append(compute_digest(scene))  # noqa: PERF401, an error keeps earlier frames
    except BitstreamError as error:
        results.append((error.reject_id, error.offset))
    except LimitError:
        results.append("declined")
    return results


@settings(deadline=None)
@given(_MUTANTS)
def test_a_mutant_decodes_the_same_in_memory_and_from_a_pipe(data):
    assert _summarize(PipeSource(io.BytesIO(data))) == _summarize(data)


def test_mutants_decode_the_same_from_a_server():
    for number in range(40):
        data = _MUTATOR.make(number).data
        with serve_data(data or b"x") as server:
            assert _summarize(HttpSource(server.url)) == _summarize(data or b"x")


@needs_fast
@settings(deadline=None)
@given(_MUTANTS)
def test_the_fast_engine_decodes_a_mutant_like_the_reference(data):
    with use_engine(REFERENCE):
        expected = _summarize(data)
    with use_engine(FAST):
        assert _drop_reject_ids(_summarize(data)) == _drop_reject_ids(expected)


def _drop_reject_ids(results):
    """Remove reject ids, because engines may report different faults of the same chunk."""
    return [result[1] if isinstance(result, tuple) else result for result in results]


@settings(deadline=None)
@given(_MUTANTS)
def test_recovery_returns_at_least_the_decoded_frames_and_lists_the_missing_ones(data):
    results = _summarize(data)
    assume("declined" not in results)
    frames = [result for result in results if isinstance(result, str)]
    try:
        events = list(recover(data))
    except BitstreamError:
        events = []
        assume(len(results) == len(frames))  # recovery may return nothing for a rejected stream
    recovered = [compute_digest(event) for event in events if not isinstance(event, Gap)]
    assert recovered[: len(frames)] == frames
    assert any(isinstance(event, Gap) for event in events) == (len(results) > len(frames))


_VERBS = {
    ("verify",): {0, 1, 3},
    ("verify", "--deep"): {0, 1, 3},
    ("info",): {0, 1, 3},
    ("inspect",): {0, 1, 3},
    ("decode", "-o", "{out}"): {0, 1, 2, 3},
    ("decode", "-o", "{out}", "--recover"): {0, 1, 2, 3},
    ("cut", "-o", "{out}", "--frames", ":"): {0, 1, 2, 3},
}


@pytest.mark.parametrize("verb", _VERBS, ids=" ".join)
def test_a_verb_reports_the_fault_of_a_mutant(verb, tmp_path):
    for number in range(12):
        data, out = _MUTATOR.make(number).data, tmp_path / f"{number}"
        (tmp_path / "mutant.quarc").write_bytes(data)
        arguments = [argument.format(out=out) for argument in verb[1:]]
        result = run(verb[0], tmp_path / "mutant.quarc", *arguments)

        assert result.exit_code in _VERBS[verb], result.stderr
        if result.exit_code:
            assert "quarc-ref: " in result.stderr
        elif verb[0] in ("verify", "info", "inspect"):
            assert all(isinstance(outcome, str) for outcome in _summarize(data))


def test_mutants_are_joined_or_rejected(tmp_path):
    (tmp_path / "whole.quarc").write_bytes(_SEEDS["moved"])
    for number in range(12):
        (tmp_path / "mutant.quarc").write_bytes(_MUTATOR.make(number).data)
        streams = [tmp_path / "whole.quarc", tmp_path / "mutant.quarc"]
        result = run("join", *streams, "-o", tmp_path / f"{number}")

        assert result.exit_code in {0, 1, 2}, result.stderr
        assert (tmp_path / f"{number}").exists() == (result.exit_code == 0)
