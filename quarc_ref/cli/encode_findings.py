"""Prints the findings of an encode to standard error, and collects them for `--json`."""

from contextlib import suppress
from dataclasses import asdict
from typing import TYPE_CHECKING

from quarc_ref.cli.output import print_message

if TYPE_CHECKING:
    from quarc_ref.datasets.findings import Finding


class FindingCollector:
    """Prints the findings that an encode reports, and stores them."""

    def __init__(self) -> None:
        self._findings: list[Finding] = []

    def add(self, finding: "Finding") -> None:
        """Print a finding to standard error, and store it."""
        self._findings.append(finding)
        with suppress(OSError):  # nobody reads it any more, which is no reason to end hours of work
            print_message(f"warning: {finding.message}")

    def as_json(self) -> list[dict[str, object]]:
        """Return all findings in the form that docs/schemas/encode.json describes."""
        return [asdict(finding) for finding in self._findings]
