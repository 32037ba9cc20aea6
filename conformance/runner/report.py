"""Reports in text, JSON and JUnit format."""

import json
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from runner.cases import CAPABILITIES, Case
from runner.judge import PASS, Verdict
from runner.manifest import SuiteError

_SCHEMA = "quarc-ref/conformance-report/1"  # schema/report.schema.json


@dataclass(frozen=True)
class Result:
    """A case, its verdict, and its duration in seconds."""

    case: Case
    verdict: Verdict
    seconds: float

    @property
    def passed(self) -> bool:
        """Whether the case passed."""
        return self.verdict.name == PASS

    @property
    def message(self) -> str:
        """Description of the error, in which control characters of the decoder are escaped.

        XML files cannot contain them, not even as character references.
        """
        return "".join(
            character if character.isprintable() else character.encode("unicode_escape").decode()
            for character in self.verdict.message
        )


@dataclass(frozen=True)
class Report:
    """All results of a decoder or an encoder.

    Attributes:
        command: Command line of the decoder or encoder.
        capabilities: Capabilities of the decoder that are tested, in the form of RUNNER.md.
        results: Results in the order of the cases.
        tool: What the command is: `decoder` or `encoder`.
    """

    command: str
    capabilities: dict[str, Any]
    results: list[Result]
    tool: str = "decoder"

    @property
    def passed(self) -> bool:
        """Whether at least one case ran and all cases passed."""
        return bool(self.results) and all(result.passed for result in self.results)

    def count_results_by(self, key: str) -> dict[str, tuple[int, int]]:
        """Return (passed cases, all cases) for each category, mode or clause."""
        counts: dict[str, list[int]] = defaultdict(lambda: [0, 0])
        for result in self.results:
            value = getattr(result.case, key)
            for name in value if isinstance(value, tuple) else (value,):
                counts[name][0] += result.passed
                counts[name][1] += 1
        return {name: (passed, total) for name, (passed, total) in sorted(counts.items())}

    def as_text(self, *, clauses: bool) -> str:
        """Return the report as text, optionally with the results of each clause."""
        failed = [result for result in self.results if not result.passed]
        lines = [f"{self.tool}: {self.command}"]
        if self.tool == "decoder":
            tested = self.capabilities.get("capabilities", [])
            capabilities = ", ".join(["decode", *tested])
            levels = ", ".join(map(str, self.capabilities.get("levels", [])))
            lines.append(f"tested: {capabilities}" + (f"; levels {levels}" if levels else ""))
            if missing := [name for name in CAPABILITIES if name not in tested]:
                lines.append(f"not tested: {', '.join(missing)}")
        lines += [f"  {r.verdict.name:<12} {r.case.name}: {r.message}" for r in failed]
        sections = {"category": "category", **({"clause": "clauses"} if clauses else {})}
        for title, key in sections.items():
            lines.append(f"by {title}:")
            lines += [
                f"  {name:<10} {passed} of {total}"
                for name, (passed, total) in self.count_results_by(key).items()
            ]
        verdicts = Counter(result.verdict.name for result in failed)
        verdict_summary = ", ".join(f"{name} {count}" for name, count in verdicts.most_common())
        passed = len(self.results) - len(failed)
        lines.append(
            f"{passed} of {len(self.results)} cases passed"
            + (f": {verdict_summary}" if verdict_summary else "")
        )
        return "\n".join(lines) + "\n"

    def as_json(self) -> dict[str, Any]:
        """Return the report as a JSON object; see schema/report.schema.json."""
        cases = [
            {
                "name": result.case.name,
                "mode": result.case.mode,
                "clauses": list(result.case.clauses),
                "verdict": result.verdict.name,
                "message": result.message,
                "seconds": round(result.seconds, 4),
            }
            for result in self.results
        ]
        clauses = {
            name: {"passed": passed, "cases": total}
            for name, (passed, total) in self.count_results_by("clauses").items()
        }
        return {
            "schema": _SCHEMA,
            "decoder": self.command,
            "capabilities": self.capabilities,
            "passed": self.passed,
            "clauses": clauses,
            "cases": cases,
        }

    def as_junit(self) -> bytes:
        """Return the content of a JUnit file, with one `testcase` element for each case."""
        failed_count = sum(not result.passed for result in self.results)
        totals = {"tests": str(len(self.results)), "failures": str(failed_count)}
        suite = ElementTree.Element("testsuite", {"name": "quarc conformance", **totals})
        for result in self.results:
            attributes = {"classname": result.case.category, "name": result.case.name}
            case = ElementTree.SubElement(
                suite, "testcase", attributes, time=f"{result.seconds:.4f}"
            )
            if not result.passed:
                failure = {"type": result.verdict.name, "message": result.message}
                ElementTree.SubElement(case, "failure", failure)
        return ElementTree.tostring(suite, encoding="utf-8", xml_declaration=True)


def write_reports(report: Report, json_path: Path | None, junit_path: Path | None) -> None:
    """Write the report to each path that is not None."""
    if json_path is not None:
        json_path.write_text(json.dumps(report.as_json(), indent=1) + "\n", "utf-8")
    if junit_path is not None:
        junit_path.write_bytes(report.as_junit())


def select_cases(cases: Iterable[Case], prefixes: list[str]) -> list[Case]:
    """Return the cases whose names begin with one of the prefixes; without prefixes, all cases.

    Raises:
        SuiteError: There is no such case.
    """
    selected = [case for case in cases if not prefixes or case.name.startswith(tuple(prefixes))]
    if not selected:
        message = f"no case that can be run has a name that begins with {' or '.join(prefixes)}"
        raise SuiteError(message)
    return selected
