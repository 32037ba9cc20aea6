"""Writes the results of a study: Markdown, CSV, JSON and a plot."""

import json
from collections.abc import Sequence
from pathlib import Path

from atomic_files import write_atomically
from quality.groups import COLUMN_NAMES, COLUMNS, Group
from quality.seed_statistics import Statistics
from quarc_ref.evaluation.plots import plot_number_groups
from rate.tables import format_csv, format_table

RESULTS_FILE = "quality.json"
_FRAME_FIGURES = (
    "held_out_psnr",
    "held_out_cc_psnr",
    "held_out_moving_psnr",
    "held_out_moving_cc_psnr",
    "training_gain_psnr",
    "training_moving_gain_psnr",
)
_PANELS = {
    "PSNR, held-out cameras (dB)": "held_out_psnr",
    "color-corrected PSNR, held-out (dB)": "held_out_cc_psnr",
    "PSNR of moving pixels, training (dB)": "training_moving_gain_psnr",
    "bytes": "bytes",
}


def write_results(groups: Sequence[Group], settings: str, folder: Path) -> None:
    """Write all files of a study.

    Args:
        groups: Groups of the study; at least one.
        settings: Preset and changed settings, as text.
        folder: Folder for the files.
    """
    study_json = {
        "settings": settings,
        "groups": [group.as_json() for group in groups],
        "rows": [row for group in groups for row in group.rows],
    }
    files = {
        "quality.md": f"{settings}\n\n{format_groups(groups)}".encode(),
        "quality.csv": format_csv([_flatten_group(group) for group in groups]),
        "frames.csv": format_csv([line for group in groups for line in _flatten_frames(group)]),
        "quality.png": _plot_groups(groups),
        RESULTS_FILE: json.dumps(study_json, indent=1).encode(),
    }
    for name, data in files.items():
        write_atomically(folder / name, data)


def format_groups(groups: Sequence[Group]) -> str:
    """Return the table of means and deviations, with a row for each capture and held-out set."""
    groups_with_statistics = [(group, group.compute_statistics()) for group in groups]
    columns = [
        column
        for column in COLUMNS
        if any(column[1] in statistics_by_name for _, statistics_by_name in groups_with_statistics)
    ]
    header = ["capture/held-out set", "seeds", *(heading for heading, *_ in columns)]
    lines = [
        [
            group.label,
            f"{len(group.rows)}",
            *(
                _format_statistics(statistics_by_name.get(name), format_spec)
                for _, name, format_spec in columns
            ),
        ]
        for group, statistics_by_name in groups_with_statistics
    ]
    return format_table(header, lines)


def _format_statistics(statistics: Statistics | None, format_spec: str) -> str:
    if statistics is None:
        return "-"
    deviation = "" if statistics.deviation is None else f" +- {statistics.deviation:{format_spec}}"
    return f"{statistics.mean:{format_spec}}{deviation}"


def _flatten_group(group: Group) -> dict[str, object]:
    statistics_by_name = group.compute_statistics()
    figures = group.rows[0]["figures"]
    names = [*COLUMN_NAMES, *(name for name in figures if name not in COLUMN_NAMES)]
    return _identify_group(group) | {
        f"{name}_{part}": value
        for name in names
        for part, value in _split_statistics(statistics_by_name.get(name)).items()
    }


def _flatten_frames(group: Group) -> list[dict[str, object]]:
    return [
        _identify_group(group)
        | {"frame": frame}
        | {
            f"{name}_{part}": value
            for name in _FRAME_FIGURES
            for part, value in _split_statistics(statistics_by_name.get(name)).items()
        }
        for frame, statistics_by_name in enumerate(group.compute_frame_statistics())
    ]


def _identify_group(group: Group) -> dict[str, object]:
    return {
        "capture": group.capture,
        "held_out_set": group.held_out_set,
        "seeds": len(group.rows),
    }


def _split_statistics(statistics: Statistics | None) -> dict[str, float | None]:
    if statistics is None:
        return {"mean": None, "deviation": None}
    return {"mean": statistics.mean, "deviation": statistics.deviation}


def _plot_groups(groups: Sequence[Group]) -> bytes:
    """Plot a dot for each seed and a bar at their mean, for every capture and held-out set."""
    panels = {}
    for heading, name in _PANELS.items():
        values = {
            group.label: [
                row["figures"][name] for row in group.rows if row["figures"][name] is not None
            ]
            for group in groups
        }
        if any(values.values()):
            panels[heading] = values
    return plot_number_groups(panels)
