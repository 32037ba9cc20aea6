"""Unit files, each of which holds known answers of one function."""

from dataclasses import dataclass
from typing import Any

_MAX_SAFE_INTEGER = (1 << 53) - 1


Input = dict[str, Any]


@dataclass(frozen=True)
class Unit:
    """A function of SPEC.md, with inputs and expected outputs.

    Attributes:
        function: Name of the function in unit files.
        note: Description of inputs and outputs.
        clauses: Ids of clauses of SPEC.md, or numbers of sections without clauses.
        cases: Inputs, each with its output or with a `Rejection`.
    """

    function: str
    note: str
    clauses: str
    cases: list[tuple[Input, Any]]

    def as_json(self) -> dict[str, Any]:
        """Return the content of the unit file as JSON values."""
        cases = [
            {"input": _encode_numbers(unit_input), **_encode_answer(answer)}
            for unit_input, answer in self.cases
        ]
        entry = {"function": self.function, "note": self.note, "clauses": self.clauses.split()}
        return entry | {"cases": cases}


class Rejection(str):
    """A reject id that is expected instead of an output."""


def _encode_answer(answer: Any) -> dict[str, Any]:
    return (
        {"refused": str(answer)}
        if isinstance(answer, Rejection)
        else {"output": _encode_numbers(answer)}
    )


def _encode_numbers(value: Any) -> Any:
    """Convert integers that a double cannot represent to decimal strings."""
    if isinstance(value, dict):
        return {key: _encode_numbers(element) for key, element in value.items()}
    if isinstance(value, list | tuple):
        return [_encode_numbers(element) for element in value]
    return str(value) if isinstance(value, int) and abs(value) > _MAX_SAFE_INTEGER else value
