"""Cases: the input of a decoder, and the expected output."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from runner.manifest import Suite

Line = dict[str, Any]
MODES = ("decode", "numbers", "seek", "recover", "grow", "unit")


@dataclass(frozen=True)
class Case:
    """One test of a decoder.

    Attributes:
        name: Name of the vector or unit, and the way it is tested.
        category: streams, traps, levels, invalid, damaged, resource or unit.
        mode: One of MODES.
        clauses: Clauses or sections of SPEC.md.
        vector: Name of the stream, or the function of a unit.
        expected: `frames`, `refused`, `gaps`, `may_decline`; for a unit, `output` or `refused`.
        job: Job for a decoder that supports jobs.
    """

    name: str
    category: str
    mode: str
    clauses: tuple[str, ...]
    vector: str
    expected: Line
    job: Line


def list_cases(suite: Suite, capabilities: Line) -> Iterator[Case]:
    """Yield the cases for a decoder with given capabilities."""
    can = set(capabilities.get("capabilities", []))
    for entry in suite.vectors.values():
        if entry.get("needs", "") in {"", *can}:
            yield from (case for case in _of_vector(entry) if case.mode in {"decode", *can})
    for unit in suite.units:
        if unit["function"] in capabilities.get("units", []):
            yield from _of_unit(unit)


def _of_vector(entry: Line) -> Iterator[Case]:
    name, clauses = entry["name"], tuple(entry["clauses"])
    category = name.split("/")[0]

    def case(suffix: str, mode: str, expected: Line, job: Line) -> Case:
        return Case(name + suffix, category, mode, clauses, name, expected, job)

    if "decode" in entry:
        yield case("", "decode", entry["decode"], {"job": "decode"})
    if "numbers" in entry:
        expected = {"numbers": entry["numbers"]}
        yield case("#numbers", "numbers", expected, {"job": "decode", "numbers": True})
    for seek in entry.get("seek", []):
        start = seek["start"]
        yield case(f"#from-{start}", "seek", seek, {"job": "decode", "start": start})
    if "recover" in entry:
        yield case("#recover", "recover", entry["recover"], {"job": "recover"})
    if entry.get("grow"):
        yield case("#grow", "grow", entry["decode"], {})


def _of_unit(unit: Line) -> Iterator[Case]:
    function, clauses = unit["function"], tuple(unit["clauses"])
    for number, known in enumerate(unit["cases"]):
        job = {"job": "unit", "function": function, "input": known["input"]}
        name = f"unit/{function}#{number}"
        yield Case(name, "unit", "unit", clauses, function, known, job)
