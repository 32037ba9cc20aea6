"""Cases: inputs for a decoder, each with the expected output."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from runner.manifest import LEVELS, Suite

Line = dict[str, Any]
MODES = ("decode", "numbers", "seek", "recover", "grow", "unit")
CAPABILITIES = ("jobs", "seek", "recover", "grow", "numbers", "metadata", "updates", "snapshots")
_CAPABILITIES_OF_JOBS = {"jobs", "seek", "recover", "numbers"}


@dataclass(frozen=True)
class Case:
    """One test of a decoder.

    Attributes:
        name: Name of the vector or unit, with a suffix for the mode.
        category: One of streams, traps, levels, invalid, damaged, resource and unit.
        mode: One of MODES.
        clauses: Numbers of the tested clauses or sections of SPEC.md.
        vector: Name of the stream; in mode `unit`, name of the function.
        expected: Expected result, with the keys `frames`, `refused`, `gaps` and `may_decline`; for
            a unit, with `output` or `refused`.
        job: The case as a job, for decoders that support jobs.
    """

    name: str
    category: str
    mode: str
    clauses: tuple[str, ...]
    vector: str
    expected: Line
    job: Line


def list_tested_capabilities(capabilities: Line, *, with_jobs: bool) -> Line:
    """Return those capabilities of a decoder that can be tested, with or without jobs."""
    tested = set(CAPABILITIES) - (set() if with_jobs else _CAPABILITIES_OF_JOBS)
    names = [name for name in capabilities.get("capabilities", []) if name in tested]
    units = capabilities.get("units", []) if with_jobs else []
    levels = {"levels": capabilities["levels"]} if "levels" in capabilities else {}
    return {"capabilities": names, "units": units, **levels}


def list_cases(suite: Suite, capabilities: Line) -> Iterator[Case]:
    """Yield the cases that a decoder with these capabilities must pass."""
    supported = set(capabilities.get("capabilities", []))
    other_levels = set(LEVELS).difference(capabilities.get("levels", LEVELS))
    for entry in suite.vectors.values():
        if entry.get("needs", "") in {"", *supported}:
            cases = [c for c in _list_vector_cases(entry) if c.mode in {"decode", *supported}]
            if other_levels and suite.read_level(entry["name"]) in other_levels:
                cases = [replace(c, expected=c.expected | {"may_decline": True}) for c in cases]
            yield from cases
    for unit in suite.units:
        if unit["function"] in capabilities.get("units", []):
            yield from _list_unit_cases(unit)


def _list_vector_cases(entry: Line) -> Iterator[Case]:
    name, clauses = entry["name"], tuple(entry["clauses"])
    category = name.split("/")[0]

    def make_case(suffix: str, mode: str, expected: Line, job: Line) -> Case:
        return Case(name + suffix, category, mode, clauses, name, expected, job)

    if "decode" in entry:
        yield make_case("", "decode", entry["decode"], {"job": "decode"})
    if "numbers" in entry:
        expected = {"numbers": entry["numbers"]}
        yield make_case("#numbers", "numbers", expected, {"job": "decode", "numbers": True})
    for seek in entry.get("seek", []):
        start = seek["start"]
        yield make_case(f"#from-{start}", "seek", seek, {"job": "decode", "start": start})
    if "recover" in entry:
        yield make_case("#recover", "recover", entry["recover"], {"job": "recover"})
    if entry.get("grow"):
        yield make_case("#grow", "grow", entry["decode"], {})


def _list_unit_cases(unit: Line) -> Iterator[Case]:
    function, clauses = unit["function"], tuple(unit["clauses"])
    for number, unit_case in enumerate(unit["cases"]):
        job = {"job": "unit", "function": function, "input": unit_case["input"]}
        name = f"unit/{function}#{number}"
        yield Case(name, "unit", "unit", clauses, function, unit_case, job)
