"""Rate and quality of settings around the default: what the sweep encodes."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import fmean

from quarc_ref.encoder.config import EncoderConfig
from quarc_ref.format.constants import ROTATION_UNITY_LIMIT
from rate.claims import Claim, amortize_file
from rate.hull import Point, gap_below, upper_hull
from rate.jobs import Job
from rate.measure import measure

Changes = tuple[tuple[str, str], ...]

_RATE_FACTORS = (0.25, 0.5, 2.0, 4.0)
_STEP_FACTORS = (0.5, 2.0)
_ANCHOR_FACTORS = (0.5, 2.0)


def list_changes(config: EncoderConfig) -> Iterator[Changes]:
    """Yield what is changed of the default, one thing at a time; first nothing."""
    yield ()
    for factor in _RATE_FACTORS:
        yield (("rate_weight", f"{config.rate_weight * factor:g}"),)
    for factor in _STEP_FACTORS:
        yield _change_step(config, factor)
    for factor in _ANCHOR_FACTORS:
        count = _scale(config.stream.gaussians_per_anchor, factor)
        yield (("stream.gaussians_per_anchor", f"{count}"),)


def sweep(job: Job, folder: Path) -> list[Point]:
    """Return rate and quality of every setting; the default first."""
    points = []
    for changes in list_changes(job.config()):
        made = measure(replace(job, changes=(*job.changes, *changes)), folder)
        label = ", ".join(f"{name}={value}" for name, value in changes)
        points.append(Point(label, amortize_file(made.summary) / 1024, fmean(made.psnr)))
    return points


def claim_hull(points: Sequence[Point]) -> Claim:
    """Return the claim that the default, the first of the points, is on their upper hull."""
    gap = gap_below(points[0], upper_hull(points))
    return Claim("dB of the default below the upper hull", gap, 0.0)


def _change_step(config: EncoderConfig, factor: float) -> Changes:
    """Return a translation step, and with it a rotation step, that is so many times as wide."""
    unity = min(_scale(config.stream.rotation_unity, 1 / factor), ROTATION_UNITY_LIMIT)
    spacing = config.steps.translation_spacing
    if spacing:
        width = ("steps.translation_spacing", f"{spacing * factor:g}")
    else:
        width = ("stream.translation_step", f"{_scale(config.stream.translation_step, factor)}")
    return (width, ("stream.rotation_unity", f"{unity}"))


def _scale(number: int, factor: float) -> int:
    return max(1, round(number * factor))
