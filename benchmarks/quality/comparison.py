"""Compares two finished studies: differences of means with their standard errors."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from quality.groups import COLUMNS
from quality.results import RESULTS
from quality.spreads import Difference, Spread, average_differences, subtract
from rate.tables import format_table
from studies import write_status

Groups = Mapping[str, Mapping[str, Any]]  # groups of a study by capture and held-out set


class ComparisonError(ValueError):
    """Two studies cannot be compared."""


def compare_studies(ours: Path, theirs: Path) -> str:
    """Return the table of the differences between two studies.

    Args:
        ours: Folder of a study.
        theirs: Folder of the other one.

    Raises:
        ComparisonError: A study has no results, or they have no capture in common.
    """
    own, others = _read_groups(ours), _read_groups(theirs)
    shared = [label for label in own if label in others]
    if not shared:
        message = f"{ours} and {theirs} have no capture and held-out set in common"
        raise ComparisonError(message)
    for label in shared:
        if own[label]["fingerprint"] != others[label]["fingerprint"]:
            write_status(f"{label}: the two studies are of captures with different files")
    differences = {label: _subtract_groups(own[label], others[label]) for label in shared}
    return _format_differences(differences)


def _read_groups(folder: Path) -> Groups:
    path = folder / RESULTS
    if not path.is_file():
        message = f"{path} does not exist: run the study first"
        raise ComparisonError(message)
    groups = json.loads(path.read_text())["groups"]
    return {f"{group['capture']}/{group['held_out_set']}": group for group in groups}


def _subtract_groups(own: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Difference]:
    """Return the difference of every figure that both groups have."""
    return {
        name: subtract(Spread(**figure), Spread(**other["figures"][name]))
        for name, figure in own["figures"].items()
        if name in other["figures"]
    }


def _format_differences(differences: Mapping[str, Mapping[str, Difference]]) -> str:
    rows = dict(differences)
    names = {name for each in differences.values() for name in each}
    rows["mean"] = {
        name: average_differences([each[name] for each in differences.values() if name in each])
        for name in names
    }
    columns = [column for column in COLUMNS if column[1] in names]
    head = ["capture/held-out set", *(heading for heading, *_ in columns)]
    lines = [
        [label, *(_format(row.get(name), how) for _, name, how in columns)]
        for label, row in rows.items()
    ]
    return format_table(head, lines)


def _format(difference: Difference | None, how: str) -> str:
    if difference is None:
        return "-"
    error = "" if difference.error is None else f" +- {difference.error:{how}}"
    return f"{difference.amount:+{how}}{error}"
