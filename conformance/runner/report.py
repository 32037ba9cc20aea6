"""Reports as text, JSON and JUnit."""

import json
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from runner.cases import Case
from runner.judge import PASS, Verdict

_SCHEMA = "quarc-ref/conformance-report/1"  # schema/report.schema.json


@dataclass(frozen=True)
class Result:
    """A case and its verdict."""

    case: Case
    verdict: Verdict
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether the case passed."""
        return self.verdict.name == PASS


@dataclass(frozen=True)
class Report:
    """All results of a decoder.

    Attributes:
        command: The decoder.
        capabilities: Capabilities that it prints.
        results: Results in the order of the cases.
    """

    command: str
    capabilities: dict[str, Any]
    results: list[Result]

    @property
    def passed(self) -> bool:
        """Whether there were cases, and all passed."""
        return bool(self.results) and all(result.passed for result in self.results)

    def by(self, key: str) -> dict[str, tuple[int, int]]:
        """Return the numbers of passed and of all cases by `category`, `mode` or `clauses`."""
        counts: dict[str, list[int]] = defaultdict(lambda: [0, 0])
        for result in self.results:
            value = getattr(result.case, key)
            for name in value if isinstance(value, tuple) else (value,):
                counts[name][0] += result.passed
                counts[name][1] += 1
        return {name: (good, all_) for name, (good, all_) in sorted(counts.items())}

    def text(self, *, clauses: bool) -> str:
        """Return the report as text."""
        failed = [result for result in self.results if not result.passed]
        lines = [f"decoder: {self.command}"]
        can = ", ".join(["decode", *self.capabilities.get("capabilities", [])])
        lines.append(f"asked for: {can}")
        lines += [f"  {r.verdict.name:<12} {r.case.name}: {r.verdict.message}" for r in failed]
        sections = {"category": "category", **({"clause": "clauses"} if clauses else {})}
        for title, key in sections.items():
            lines.append(f"by {title}:")
            lines += [
                f"  {name:<10} {good} of {all_}" for name, (good, all_) in self.by(key).items()
            ]
        verdicts = Counter(result.verdict.name for result in failed)
        said = ", ".join(f"{name} {count}" for name, count in verdicts.most_common())
        good = len(self.results) - len(failed)
        lines.append(f"{good} of {len(self.results)} cases passed" + (f": {said}" if said else ""))
        return "\n".join(lines) + "\n"

    def as_json(self) -> dict[str, Any]:
        """Return the report as JSON; see schema/report.schema.json."""
        cases = [
            {
                "name": r.case.name,
                "mode": r.case.mode,
                "clauses": list(r.case.clauses),
                "verdict": r.verdict.name,
                "message": r.verdict.message,
                "seconds": round(r.seconds, 4),
            }
            for r in self.results
        ]
        clauses = {
            name: {"passed": good, "cases": n} for name, (good, n) in self.by("clauses").items()
        }
        return {
            "schema": _SCHEMA,
            "decoder": self.command,
            "capabilities": self.capabilities,
            "passed": self.passed,
            "clauses": clauses,
            "cases": cases,
        }

    def junit(self) -> bytes:
        """Return a JUnit file with a test case for each case."""
        failed = sum(not result.passed for result in self.results)
        numbers = {"tests": str(len(self.results)), "failures": str(failed)}
        suite = ElementTree.Element("testsuite", {"name": "quarc conformance", **numbers})
        for result in self.results:
            names = {"classname": result.case.category, "name": result.case.name}
            case = ElementTree.SubElement(suite, "testcase", names, time=f"{result.seconds:.4f}")
            if not result.passed:
                message = {"type": result.verdict.name, "message": result.verdict.message}
                ElementTree.SubElement(case, "failure", message)
        return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True)


def write_reports(report: Report, as_json: Path | None, junit: Path | None) -> None:
    """Write the requested files."""
    if as_json is not None:
        as_json.write_text(json.dumps(report.as_json(), indent=1) + "\n", "utf-8")
    if junit is not None:
        junit.write_bytes(report.junit())


def select(cases: Iterable[Case], wanted: list[str]) -> list[Case]:
    """Return the cases with names that have one of the prefixes; all without prefixes."""
    return [case for case in cases if not wanted or case.name.startswith(tuple(wanted))]
