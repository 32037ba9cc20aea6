"""Tests that the verdicts of the runner say what is wrong and where."""

import pytest

from runner.cases import Case
from runner.judge import Verdict, judge

FRAMES = [[0, 5, "00"], [1, 6, "01"], [2, 6, "02"]]
LINES = [{"frame": 0, "gaussians": 5, "sha256": "00"}, {"frame": 1, "gaussians": 6, "sha256": "01"}]
NUMBERS = [{"frame": 0, "numbers_sha256": "a0"}, {"frame": 1, "numbers_sha256": "a1"}]
END = {"refused": "state-crc"}


def make_case(mode="decode", **expected):
    return Case("a", "streams", mode, (), "a", {"frames": FRAMES, **expected}, {})


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([LINES[0], {**LINES[1], "gaussians": 7}], "frame 1 has 7 Gaussians instead of 6"),
        ([LINES[0], {**LINES[1], "sha256": "02"}], "the digest of frame 1 is not the expected one"),
        ([*LINES, END], "refused: state-crc after frame 1"),
        ([END], "refused: state-crc"),
        (LINES, "frame 2 is missing"),
    ],
)
def test_a_verdict_on_frames_names_the_frame(lines, message):
    assert judge(make_case(), lines).message == message


def test_a_missing_frame_before_a_fault_is_explained_by_the_rejection():
    case = make_case(refused=["field"])
    message = "frame 2, which precedes the fault, is missing"
    assert judge(case, LINES) == Verdict("missing", message)
    early = Verdict("missing", f"{message} (refused: state-crc after frame 1)")
    assert judge(case, [*LINES, END]) == early


@pytest.mark.parametrize(
    ("lines", "verdict"),
    [
        (NUMBERS, Verdict("pass")),
        (
            [NUMBERS[0], {**NUMBERS[1], "numbers_sha256": "a2"}],
            Verdict("wrong", "the dequantized numbers of frame 1 differ"),
        ),
        (NUMBERS[:1], Verdict("wrong", "the dequantized numbers of frame 1 differ")),
        ([*NUMBERS, {"frame": 2}], Verdict("wrong", "the dequantized numbers of frame 2 differ")),
        ([NUMBERS[0], END], Verdict("refused", "refused: state-crc after frame 0")),
        ([*NUMBERS, {"gap": {}}], Verdict("gaps", "1 gaps, expected 0")),
        ([*NUMBERS, END], Verdict("refused", "refused: state-crc after frame 1")),
    ],
)
def test_a_verdict_on_numbers_names_the_frame_or_the_rejection(lines, verdict):
    assert judge(make_case("numbers", numbers=[[0, "a0"], [1, "a1"]]), lines) == verdict


def test_a_gap_that_is_not_an_object_is_a_wrong_gap():
    gap = {"offset": 8, "bytes": 4, "frames_lost": 0, "refused": ["sync"]}
    case = Case("a", "damaged", "recover", (), "a", {"frames": [], "gaps": [gap]}, {})
    assert judge(case, [{"gap": 5}]).name == "gaps"
