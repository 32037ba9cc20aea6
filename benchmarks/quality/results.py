"""Writes the results of a study: Markdown, CSV, JSON and a plot."""

import json
from collections.abc import Sequence
from pathlib import Path

from kept_files import write_atomically
from quality.groups import COLUMN_NAMES, COLUMNS, Group
from quality.spreads import Spread
from quarc_ref.evaluation.plots import plot_spreads
from rate.tables import format_table, write_csv

RESULTS = "quality.json"
_FRAME_FIGURES = (
    "held_out_psnr",
    "held_out_cc_psnr",
    "held_out_moving_psnr",
    "held_out_moving_cc_psnr",
    "training_gain_psnr",
    "training_moving_gain_psnr",
)
_PANELS = {
    "PSNR, held out (dB)": "held_out_psnr",
    "color-corrected (dB)": "held_out_cc_psnr",
    "moving, training, gains (dB)": "training_moving_gain_psnr",
    "bytes": "bytes",
}


def write_results(groups: Sequence[Group], settings: str, folder: Path) -> None:
    """Write all files of a study.

    Args:
        groups: At least one.
        settings: Preset and changes, as text.
        folder: Where to.
    """
    whole = {
        "settings": settings,
        "groups": [group.as_json() for group in groups],
        "rows": [row for group in groups for row in group.rows],
    }
    files = {
        "quality.md": f"{settings}\n\n{format_groups(groups)}".encode(),
        "quality.csv": write_csv([_flatten(group) for group in groups]),
        "frames.csv": write_csv([line for group in groups for line in _flatten_frames(group)]),
        "quality.png": _plot(groups),
        RESULTS: json.dumps(whole, indent=1).encode(),
    }
    for name, data in files.items():
        write_atomically(folder / name, data)


def format_groups(groups: Sequence[Group]) -> str:
    """Return the table of means and deviations, with a line for each capture and held-out set."""
    listed = [(group, group.spreads()) for group in groups]
    columns = [column for column in COLUMNS if any(column[1] in spreads for _, spreads in listed)]
    head = ["capture/held-out set", "seeds", *(heading for heading, *_ in columns)]
    lines = [
        [
            group.label,
            f"{len(group.rows)}",
            *(_format(spreads.get(name), how) for _, name, how in columns),
        ]
        for group, spreads in listed
    ]
    return format_table(head, lines)


def _format(spread: Spread | None, how: str) -> str:
    if spread is None:
        return "-"
    deviation = "" if spread.deviation is None else f" +- {spread.deviation:{how}}"
    return f"{spread.mean:{how}}{deviation}"


def _flatten(group: Group) -> dict[str, object]:
    spreads = group.spreads()
    figures = group.rows[0]["figures"]
    names = [*COLUMN_NAMES, *(name for name in figures if name not in COLUMN_NAMES)]
    return _label(group) | {
        f"{name}_{part}": value
        for name in names
        for part, value in _parts(spreads.get(name)).items()
    }


def _flatten_frames(group: Group) -> list[dict[str, object]]:
    return [
        _label(group)
        | {"frame": frame}
        | {
            f"{name}_{part}": value
            for name in _FRAME_FIGURES
            for part, value in _parts(spreads.get(name)).items()
        }
        for frame, spreads in enumerate(group.frame_spreads())
    ]


def _label(group: Group) -> dict[str, object]:
    return {
        "capture": group.capture,
        "held_out_set": group.held_out_set,
        "seeds": len(group.rows),
    }


def _parts(spread: Spread | None) -> dict[str, float | None]:
    if spread is None:
        return {"mean": None, "deviation": None}
    return {"mean": spread.mean, "deviation": spread.deviation}


def _plot(groups: Sequence[Group]) -> bytes:
    """Plot a dot for each seed and a bar for each mean, for every capture and held-out set."""
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
    return plot_spreads(panels)
