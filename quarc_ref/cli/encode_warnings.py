"""What an encode finds wrong, said on standard error at once, and kept for JSON."""

from dataclasses import asdict
from typing import TYPE_CHECKING

from quarc_ref.cli.output import print_message

if TYPE_CHECKING:
    from quarc_ref.datasets.findings import Finding


class Warnings:
    """The findings of an encode so far."""

    def __init__(self) -> None:
        self._findings: list[Finding] = []

    def add(self, finding: "Finding") -> None:
        """Say a finding on standard error, and keep it."""
        print_message(f"warning: {finding.message}")
        self._findings.append(finding)

    def as_json(self) -> list[dict[str, object]]:
        """Return all findings as docs/schemas/encode.json has them."""
        return [asdict(finding) for finding in self._findings]
