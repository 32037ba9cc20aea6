"""Compares two finished studies: differences of their means, with standard errors."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from quality.groups import COLUMNS
from quality.results import RESULTS_FILE
from quality.seed_statistics import Difference, Statistics, average_differences, subtract
from rate.tables import format_table
from studies import write_status

Groups = Mapping[str, Mapping[str, Any]]  # groups of a study by capture and held-out set


class ComparisonError(ValueError):
    """Two studies cannot be compared."""


def compare_studies(folder: Path, other_folder: Path) -> str:
    """Return the table of the differences between two studies.

    Args:
        folder: Folder of the study from which the other one is subtracted.
        other_folder: Folder of the study to subtract.

    Raises:
        ComparisonError: A study has no results, or the studies have no pair of capture and held-out
            set in common.
    """
    groups, other_groups = _read_groups(folder), _read_groups(other_folder)
    shared = [label for label in groups if label in other_groups]
    if not shared:
        message = f"{folder} and {other_folder} have no capture and held-out set in common"
        raise ComparisonError(message)
    for label in shared:
        _warn_of_differences(label, groups[label], other_groups[label])
    differences = {label: _subtract_groups(groups[label], other_groups[label]) for label in shared}
    return _format_differences(differences)


def _read_groups(folder: Path) -> Groups:
    path = folder / RESULTS_FILE
    if not path.is_file():
        message = f"{path} does not exist: run the study first"
        raise ComparisonError(message)
    groups = json.loads(path.read_text())["groups"]
    return {f"{group['capture']}/{group['held_out_set']}": group for group in groups}


def _warn_of_differences(label: str, group: Mapping[str, Any], other: Mapping[str, Any]) -> None:
    """Warn if two groups differ in more than the settings of the encoder."""
    if group["fingerprint"] != other["fingerprint"]:
        write_status(f"{label}: the files of this capture differ between the two studies")
    counts = [results.get("frames") for results in (group, other)]  # not in older results
    if None not in counts and counts[0] != counts[1]:
        write_status(
            f"{label}: the studies have different numbers of frames, {counts[0]} and {counts[1]}"
        )


def _subtract_groups(group: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Difference]:
    """Return the difference of each figure that is in both groups."""
    return {
        name: subtract(Statistics(**figure), Statistics(**other["figures"][name]))
        for name, figure in group["figures"].items()
        if name in other["figures"]
    }


def _format_differences(differences: Mapping[str, Mapping[str, Difference]]) -> str:
    rows = dict(differences)
    names = {name for figures in differences.values() for name in figures}
    rows["mean"] = {
        name: average_differences(
            [figures[name] for figures in differences.values() if name in figures]
        )
        for name in names
    }
    columns = [column for column in COLUMNS if column[1] in names]
    header = ["capture/held-out set", *(heading for heading, *_ in columns)]
    lines = [
        [
            label,
            *(_format_difference(row.get(name), format_spec) for _, name, format_spec in columns),
        ]
        for label, row in rows.items()
    ]
    return format_table(header, lines)


def _format_difference(difference: Difference | None, format_spec: str) -> str:
    if difference is None:
        return "-"
    error = "" if difference.error is None else f" +- {difference.error:{format_spec}}"
    return f"{difference.amount:+{format_spec}}{error}"
