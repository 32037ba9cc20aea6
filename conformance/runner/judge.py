"""Compares the output of a decoder with the expected output."""

from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

from runner.cases import Case

Line = dict[str, Any]
PASS = "pass"
VERDICTS = (
    *(PASS, "silent", "missing", "extra", "wrong", "not-refused", "refused", "wrong-id", "gaps"),
    *("status", "garbage", "crash", "timeout", "memory", "level", "bounds"),
)
"""Names of all verdicts; README.md explains them."""


@dataclass(frozen=True)
class Verdict:
    """The verdict on a case.

    Attributes:
        name: One of VERDICTS.
        message: Description of the error; empty if the case passed.
    """

    name: str
    message: str = ""


def judge(case: Case, lines: list[Line]) -> Verdict:
    """Return the verdict on the lines that a decoder printed, given that it did not crash."""
    for line in lines:
        if not line.keys() & {"frame", "gap", "refused", "declined", "output"}:
            return Verdict("garbage", f"a line has none of the keys of RUNNER.md: {str(line)[:80]}")
    if case.mode == "unit":
        return _judge_unit(case, lines)
    end_lines = [line for line in lines if "refused" in line or "declined" in line]
    if len(end_lines) > 1 or (end_lines and lines[-1] is not end_lines[0]):
        return Verdict("extra", "lines follow the line with `refused` or `declined`")
    if end_lines and "declined" in end_lines[0] and case.expected.get("may_decline"):
        return Verdict(PASS)
    if case.mode == "numbers":
        return _judge_numbers(case, lines)
    return _judge_frames(case, lines) or _judge_end(case, lines) or _judge_gaps(case, lines)


def _judge_frames(case: Case, lines: list[Line]) -> Verdict | None:
    expected = case.expected["frames"]
    printed_rows = [
        [line["frame"], line.get("gaussians"), line.get("sha256")]
        for line in lines
        if "frame" in line
    ]
    if not lines and (expected or case.expected.get("refused")):
        return Verdict("silent", "the decoder printed nothing")
    for printed, expected_row in zip(printed_rows, expected, strict=False):
        if printed != expected_row:
            return Verdict("wrong", _describe_difference(printed, expected_row))
    if len(printed_rows) > len(expected):
        return Verdict(
            "extra", f"frame {printed_rows[len(expected)][0]} was printed but is not expected"
        )
    if len(printed_rows) == len(expected):
        return None
    missing, rejection = f"frame {expected[len(printed_rows)][0]}", _find_rejection(lines)
    if not case.expected.get("refused"):
        return rejection or Verdict("missing", f"{missing} is missing")
    cause = f" ({rejection.message})" if rejection else ""
    return Verdict("missing", f"{missing}, which precedes the fault, is missing{cause}")


def _describe_difference(printed: list[Any], expected: list[Any]) -> str:
    frame, count = printed[:2]
    if frame != expected[0]:
        return f"frame {frame} was printed instead of frame {expected[0]}"
    if count != expected[1]:
        return f"frame {frame} has {count} Gaussians instead of {expected[1]}"
    return f"the digest of frame {frame} is not the expected one"


def _find_rejection(lines: list[Line]) -> Verdict | None:
    last_line = lines[-1] if lines else {}
    frames = [line["frame"] for line in lines if "frame" in line]
    place = f" after frame {frames[-1]}" if frames else ""
    for key in ("refused", "declined"):
        if key in last_line:
            return Verdict("refused", f"{key}: {last_line[key]}{place}")
    return None


def _judge_end(case: Case, lines: list[Line]) -> Verdict | None:
    allowed, rejection = case.expected.get("refused", []), _find_rejection(lines)
    if not allowed:
        return rejection
    if rejection is None:
        return Verdict(
            "not-refused", f"the stream was not rejected, expected {' or '.join(allowed)}"
        )
    if lines[-1].get("refused") not in allowed:
        reject_id = lines[-1].get("refused", "declined")
        return Verdict("wrong-id", f"{reject_id}, expected {' or '.join(allowed)}")
    return None


def _judge_gaps(case: Case, lines: list[Line]) -> Verdict:
    printed_gaps = [line["gap"] for line in lines if "gap" in line]
    expected_gaps = case.expected.get("gaps", [])
    if len(printed_gaps) != len(expected_gaps):
        return Verdict("gaps", f"{len(printed_gaps)} gaps, expected {len(expected_gaps)}")
    for printed, gap in zip(printed_gaps, expected_gaps, strict=True):
        matches = isinstance(printed, dict) and all(
            printed.get(key) == gap[key] for key in ("offset", "bytes", "frames_lost")
        )
        if not matches or printed.get("refused") not in gap["refused"]:
            return Verdict("gaps", f"gap {printed}, expected {gap}")
    return Verdict(PASS)


def _judge_numbers(case: Case, lines: list[Line]) -> Verdict:
    if not lines:
        return Verdict("silent", "the decoder printed nothing")
    rows = [[line["frame"], line.get("numbers_sha256")] for line in lines if "frame" in line]
    for printed, expected_row in zip_longest(rows, case.expected["numbers"]):
        if printed != expected_row:
            frame = (expected_row or printed)[0]
            wrong = Verdict("wrong", f"the dequantized numbers of frame {frame} differ")
            return wrong if printed else _find_rejection(lines) or wrong
    return _find_rejection(lines) or _judge_gaps(case, lines)


def _judge_unit(case: Case, lines: list[Line]) -> Verdict:
    if not lines:
        return Verdict("silent", "the decoder printed nothing")
    if len(lines) > 1:
        return Verdict("extra", "the decoder printed more than one line")
    key = "output" if "output" in case.expected else "refused"
    answer, expected = lines[0].get(key), case.expected[key]
    if answers_match(answer, expected):
        return Verdict(PASS)
    return Verdict("wrong", f"{str(lines[0])[:80]}, expected {str(expected)[:60]}")


def answers_match(answer: Any, expected: Any) -> bool:
    """Return whether an answer is the expected one; integers may be decimal strings."""
    if isinstance(answer, list) and isinstance(expected, list):
        return len(answer) == len(expected) and all(map(answers_match, answer, expected))
    if isinstance(answer, dict) and isinstance(expected, dict):
        return answer.keys() == expected.keys() and all(
            answers_match(answer[key], expected[key]) for key in expected
        )
    return str(answer) == str(expected)
