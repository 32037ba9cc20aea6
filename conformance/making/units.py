"""The form of a known answer."""

from dataclasses import dataclass
from typing import Any

_SAFE = (1 << 53) - 1


Input = dict[str, Any]


@dataclass(frozen=True)
class Unit:
    """A function of SPEC with inputs and outputs.

    Attributes:
        function: Its name.
        note: Description of inputs and outputs.
        clauses: Clauses of SPEC.md, or sections without clauses.
        cases: Inputs and outputs; an output can be a rejection.
    """

    function: str
    note: str
    clauses: str
    cases: list[tuple[Input, Any]]

    def as_json(self) -> dict[str, Any]:
        """Return the content of the file."""
        cases = [{"input": _plain(given), **_answer(answer)} for given, answer in self.cases]
        said = {"function": self.function, "note": self.note, "clauses": self.clauses.split()}
        return said | {"cases": cases}


class Refusal(str):
    """A reject id in place of an output."""


def _answer(answer: Any) -> dict[str, Any]:
    return {"refused": str(answer)} if isinstance(answer, Refusal) else {"output": _plain(answer)}


def _plain(value: Any) -> Any:
    """Convert integers that a double cannot represent to decimal strings."""
    if isinstance(value, dict):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return str(value) if isinstance(value, int) and abs(value) > _SAFE else value
