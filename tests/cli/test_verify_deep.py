import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format.coding.ans import PythonBitDecoder
from quarc_ref.inspection import cross_check, verify_stream
from tests.cli.commands import run, run_json
from tests.small_streams import make_stream

_DATA, _STATES = make_stream(gaussian_count=20, frame_count=7, canonical_every=3)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "some.quarc"
    path.write_bytes(_DATA)
    return path


def test_completed_checks_are_listed(file):
    json_output = run_json("verify", file, "--deep")

    assert (json_output["valid"], json_output["frames"]) == (True, 7)
    assert json_output["state_sha256"] == compute_digest(_STATES[-1].scene)
    deep_checks = json_output["deep"]
    assert (deep_checks["frames"], deep_checks["frames_compared"], deep_checks["seek_points"]) == (
        7,
        7,
        3,
    )
    assert deep_checks["level"] == 1.0
    assert deep_checks["limits"]["gaussians"] == 65536

    text = " ".join(run("verify", file, "--deep").stdout.split())
    assert f"{deep_checks['bits']:,} bits in {deep_checks['sections']} sections" in text
    assert "3, all with the same states (7 frames compared)" in text
    assert f"largest values: {deep_checks['maxima']['gaussians']} of 65,536 Gaussians" in text


@pytest.mark.parametrize("size", [5, 300, 2000, len(_DATA) - 1])
def test_a_fault_is_named_with_the_frames_before_it(size, file):
    file.write_bytes(_DATA[:size])
    deep_run, plain_run = (
        run("verify", file, *extra_options, "--json", "-q") for extra_options in (["--deep"], [])
    )

    assert (deep_run.exit_code, deep_run.stdout, deep_run.stderr) == (
        1,
        plain_run.stdout,
        plain_run.stderr,
    )
    assert '"refused": "truncated"' in deep_run.stdout


def test_differing_decoders_are_a_failure_of_the_tool_and_not_of_the_stream(file, monkeypatch):
    class WrongDecoder(PythonBitDecoder):
        def take(self, count, weight):
            return ~super().take(count, weight)

    with monkeypatch.context() as patch:
        patch.setattr(cross_check, "PythonBitDecoder", WrongDecoder)
        result = run("verify", file, "--deep")

    assert result.exit_code == 3
    assert "entropy decoders" in result.stderr
    assert run("verify", file, "--deep").exit_code == 0


def test_with_one_decoder_no_comparison_is_claimed(file, monkeypatch):
    monkeypatch.setattr(verify_stream, "HAS_CONSTRICTION", False)

    assert run_json("verify", file, "--deep")["deep"]["entropy_decoders"] == 1
    text = " ".join(run("verify", file, "--deep").stdout.split())
    assert "constriction, is not installed" in text
    assert "both decoders" not in text
