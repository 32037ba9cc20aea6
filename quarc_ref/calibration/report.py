"""Writes an HTML page about the quality of a calibration and about cameras without a pose."""

import html
from importlib import resources
from pathlib import Path

from quarc_ref.calibration.calibrate import Calibration
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.plots import plot_rig
from quarc_ref.datasets.calibration import Lens
from quarc_ref.evaluation.pages import embed_png, fill_page, format_table
from quarc_ref.files import OutputFolder

PAGE_NAME = "calibration.html"
_SYNC_SENTENCES = {
    SyncMethod.SOUND: "Time offsets were estimated from the sound of the recordings.",
    SyncMethod.MOTION: "Time offsets were estimated from motion in the recordings.",
    SyncMethod.NONE: (
        "Time offsets were not estimated: all recordings are assumed to start at the same time."
    ),
}


def write_report(calibration: Calibration, name: str, folder: OutputFolder) -> Path:
    """Write the page, and return its path.

    Args:
        calibration: Calibration to describe.
        name: Name of the rig, for the title.
        folder: Output folder.
    """
    world = calibration.world
    unit = "meters" if world.meters_per_unit else "units"
    plot = plot_rig(world.cameras, calibration.points, unit)
    calibrated_count, camera_count = len(world.cameras), calibration.camera_count
    template = resources.files(__package__).joinpath("report.html").read_text("utf-8")
    parts = {
        "title": html.escape(f"{name}: {calibrated_count} of {camera_count} cameras calibrated"),
        "subtitle": html.escape(
            f"The up axis is determined by {world.up_source}. One unit is "
            + (
                "one meter. "
                if world.meters_per_unit
                else (
                    "the mean distance between the cameras and the point that they look at; to "
                    "make it one meter, use --meters CAM_A CAM_B D. "
                )
            )
            + _SYNC_SENTENCES[calibration.offsets.method]
        ),
        "figures": _format_key_figures(calibration),
        "plot": embed_png(plot),
        "left_out": _format_left_out(calibration),
        "cameras": format_table(CAMERA_HEADINGS, make_camera_rows(calibration)),
        "lenses": format_table(*_make_lens_table(calibration)),
    }
    return folder.write(PAGE_NAME, fill_page(template, parts))


CAMERA_HEADINGS = (
    "camera",
    "error, px",
    "median, px",
    "points",
    "seen by 3+ cameras",
    "offset, frames",
    "confidence",
)


def make_camera_rows(calibration: Calibration) -> list[list[str]]:
    """Return one table row per calibrated camera; the column headings are `CAMERA_HEADINGS`."""
    offsets = calibration.offsets
    rows = []
    for camera in calibration.world.cameras:
        fit = calibration.solution.fits[camera.name]
        confidence = offsets.confidence.get(camera.name)
        offset = f"{offsets.frame_offsets[camera.name]:+z.2f}"
        rows.append(
            [
                camera.name,
                f"{fit.mean_error:.2f}",
                f"{fit.median_error:.2f}",
                f"{fit.point_count:,}",
                f"{fit.support:,}",
                "unreliable" if camera.name in offsets.unreliable_cameras else offset,
                "" if confidence is None else f"{confidence:.1f}",
            ]
        )
    return rows


def _format_key_figures(calibration: Calibration) -> str:
    offset_sizes = [abs(offset) for offset in calibration.offsets.frame_offsets.values()]
    figures = {
        "calibrated cameras": f"{len(calibration.world.cameras)} of {calibration.camera_count}",
        "mean reprojection error": f"{calibration.solution.mean_error:.2f} px",
        "points at frame 0": f"{len(calibration.points.positions):,}",
        "time points used": f"{calibration.moment_count}",
        "largest offset": f"{max(offset_sizes):.1f} frames",
    }
    return "".join(f"<div><dt>{key}</dt><dd>{value}</dd></div>" for key, value in figures.items())


def _format_left_out(calibration: Calibration) -> str:
    if not calibration.left_out:
        return "<p>All cameras were calibrated.</p>"
    items = "".join(
        f"<li><b>{html.escape(name)}</b>: {html.escape(reason)}</li>"
        for name, reason in calibration.left_out.items()
    )
    return f"<ul>{items}</ul>"


def _make_lens_table(calibration: Calibration) -> tuple[tuple[str, ...], list[list[str]]]:
    """Return the headings and one row per lens; a row names the cameras that share the lens."""
    lenses: dict[Lens, list[str]] = {}
    for camera in calibration.world.cameras:
        lenses.setdefault(camera.lens, []).append(camera.name)
    rows = [
        [
            ", ".join(names) if len(names) < 4 else f"{names[0]} and {len(names) - 1} more",
            f"{lens.width} x {lens.height}",
            f"{lens.fx:.1f}, {lens.fy:.1f}",
            f"{lens.cx:.1f}, {lens.cy:.1f}",
            ", ".join(f"{value:.4f}" for value in lens.coefficients) or "none",
        ]
        for lens, names in lenses.items()
    ]
    return (
        "cameras",
        "picture, px",
        "focal lengths, px",
        "principal point, px",
        "distortion",
    ), rows
