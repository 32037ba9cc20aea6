"""Compares the output of a decoder with the expected output."""

from dataclasses import dataclass
from typing import Any

from runner.cases import Case

Line = dict[str, Any]
PASS = "pass"
VERDICTS = (
    *(PASS, "silent", "missing", "extra", "wrong", "not-refused", "refused", "wrong-id", "gaps"),
    *("status", "garbage", "crash", "timeout", "memory", "level", "bounds"),
)
"""All verdicts on a case; README.md explains them."""


@dataclass(frozen=True)
class Verdict:
    """The verdict on a case.

    Attributes:
        name: One of VERDICTS.
        message: What was amiss.
    """

    name: str
    message: str = ""


def judge(case: Case, lines: list[Line]) -> Verdict:
    """Return the verdict on a decoder that ended a case without a crash."""
    for line in lines:
        if not line.keys() & {"frame", "gap", "refused", "declined", "output"}:
            return Verdict("garbage", f"a line without any known key: {str(line)[:80]}")
    if case.mode == "unit":
        return _judge_unit(case, lines)
    if case.mode == "numbers":
        return _judge_numbers(case, lines)
    ended = [line for line in lines if "refused" in line or "declined" in line]
    if len(ended) > 1 or (ended and lines[-1] is not ended[0]):
        return Verdict("extra", "lines follow a refusal")
    if ended and "declined" in ended[0] and case.expected.get("may_decline"):
        return Verdict(PASS)
    return _judge_frames(case, lines) or _judge_end(case, ended) or _judge_gaps(case, lines)


def _judge_frames(case: Case, lines: list[Line]) -> Verdict | None:
    expected = case.expected["frames"]
    said = [
        [line["frame"], line.get("gaussians"), line.get("sha256")]
        for line in lines
        if "frame" in line
    ]
    if not lines and (expected or case.expected.get("refused")):
        return Verdict("silent", "nothing was said")
    for mine, due in zip(said, expected, strict=False):
        if mine[0] != due[0]:
            return Verdict("wrong", f"frame {mine[0]} was printed instead of frame {due[0]}")
        if mine != due:
            return Verdict("wrong", f"frame {due[0]} differs from the encoded one")
    if len(said) > len(expected):
        return Verdict("extra", f"frame {said[len(expected)][0]} was printed but must not be")
    if len(said) < len(expected) and not case.expected.get("refused"):
        return _find_rejection(lines) or Verdict(
            "missing", f"frame {expected[len(said)][0]} is missing"
        )
    if len(said) < len(expected):
        return Verdict("missing", f"frame {expected[len(said)][0]} is missing before the fault")
    return None


def _find_rejection(lines: list[Line]) -> Verdict | None:
    last = lines[-1] if lines else {}
    for word in ("refused", "declined"):
        if word in last:
            return Verdict("refused", f"{word}: {last[word]}")
    return None


def _judge_end(case: Case, ended: list[Line]) -> Verdict | None:
    allowed = case.expected.get("refused", [])
    if not allowed:
        return _find_rejection(ended)
    if not ended:
        return Verdict("not-refused", f"{' or '.join(allowed)} was expected")
    if ended[0].get("refused") not in allowed:
        said = ended[0].get("refused", "declined")
        return Verdict("wrong-id", f"{said}, expected {' or '.join(allowed)}")
    return None


def _judge_gaps(case: Case, lines: list[Line]) -> Verdict:
    said = [line["gap"] for line in lines if "gap" in line]
    due = case.expected.get("gaps", [])
    if len(said) != len(due):
        return Verdict("gaps", f"{len(said)} gaps, not {len(due)}")
    for mine, gap in zip(said, due, strict=True):
        same = all(mine.get(key) == gap[key] for key in ("offset", "bytes", "frames_lost"))
        if not same or mine.get("refused") not in gap["refused"]:
            return Verdict("gaps", f"gap {mine}, expected {gap}")
    return Verdict(PASS)


def _judge_numbers(case: Case, lines: list[Line]) -> Verdict:
    said = [[line.get("frame"), line.get("numbers_sha256")] for line in lines]
    if not said:
        return Verdict("silent", "nothing was said")
    return Verdict(PASS) if said == case.expected["numbers"] else Verdict("wrong", "other numbers")


def _judge_unit(case: Case, lines: list[Line]) -> Verdict:
    if not lines:
        return Verdict("silent", "nothing was said")
    if len(lines) > 1:
        return Verdict("extra", "more than one line")
    key = "output" if "output" in case.expected else "refused"
    said, due = lines[0].get(key), case.expected[key]
    if same_numbers(said, due):
        return Verdict(PASS)
    return Verdict("wrong", f"{str(lines[0])[:80]}, expected {str(due)[:60]}")


def same_numbers(said: Any, due: Any) -> bool:
    """Return whether two answers are equal; an integer may be a decimal string."""
    if isinstance(said, list) and isinstance(due, list):
        return len(said) == len(due) and all(map(same_numbers, said, due))
    if isinstance(said, dict) and isinstance(due, dict):
        return said.keys() == due.keys() and all(same_numbers(said[key], due[key]) for key in due)
    return str(said) == str(due)
