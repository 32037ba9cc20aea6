"""Encodes a capture with variations of the default settings, and measures the streams.

All variations start from the same canonical frame, which is trained once. If it were trained again
for each variation, the PSNR would change by tenths of a dB, which is more than the effect of most
settings.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from statistics import fmean

from canonical_cache import CanonicalCache
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.adapt_steps import adapt_steps_to_capture
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.format.constants import ROTATION_UNITY_LIMIT
from rate.claims import Claim, amortize_file
from rate.hull import Point, find_upper_hull, measure_gap_to_hull
from rate.jobs import Job
from rate.measure import measure

Changes = tuple[tuple[str, str], ...]

_LAMBDA_FACTORS = (0.25, 0.5, 2.0, 4.0)
_STEP_FACTORS = (0.5, 2.0)
_GAUSSIANS_PER_ANCHOR_FACTORS = (0.5, 2.0)


def list_variations(config: EncoderConfig) -> Iterator[tuple[str, Changes]]:
    """Yield a label and the changed settings of each variation; the first changes nothing.

    The training of frame 0 does not depend on the changed settings.

    Args:
        config: Default settings with the changes from `list_fixed_steps`.
    """
    yield "", ()
    for factor in _LAMBDA_FACTORS:
        lambda_changes = (
            ("motion.rd_lambda", f"{config.motion.rd_lambda * factor:g}"),
            ("births.rd_lambda", f"{config.births.rd_lambda * factor:g}"),
        )
        yield f"rate-distortion weights x {factor:g}", lambda_changes
    for factor in _STEP_FACTORS:
        yield f"steps x {factor:g}", _change_step(config, factor)
    for factor in _GAUSSIANS_PER_ANCHOR_FACTORS:
        count = _scale_and_round(config.stream.gaussians_per_anchor, factor)
        yield f"{count} Gaussians per anchor", (("stream.gaussians_per_anchor", f"{count}"),)


def list_fixed_steps(config: EncoderConfig, capture: Capture) -> Changes:
    """Return changes that set the quantization steps to the values adapted to a capture.

    If the translation step is chosen from the error of frame 0, no changes are needed: frame 0 is
    the same in all variations, so the step is, too.
    """
    if config.steps.translation_error:
        return ()
    stream = adapt_steps_to_capture(config, capture).stream
    return (
        ("steps.position_pixels", "0"),
        ("steps.translation_change", "0"),
        ("stream.lattice_exponent", f"{stream.lattice_exponent}"),
        ("stream.position_step", f"{stream.position_step}"),
        ("stream.translation_step", f"{stream.translation_step}"),
    )


def measure_sweep(job: Job, folder: Path) -> list[Point]:
    """Return the rate and quality of each variation; the default settings come first."""
    options = CaptureOptions(job.downscale, job.held_out)
    capture = open_capture(job.capture, options)
    job = replace(job, changes=(*job.changes, *list_fixed_steps(job.make_config(), capture)))
    canonical_inputs = [capture.fingerprint, asdict(options), job.make_config().seed]
    points = []
    with CanonicalCache(folder / "canonical", canonical_inputs).use_in_encode():
        for label, changes in list_variations(job.make_config()):
            stream = measure(replace(job, changes=(*job.changes, *changes)), folder)
            points.append(Point(label, amortize_file(stream.summary) / 1024, fmean(stream.psnr)))
    return points


def make_hull_claim(points: Sequence[Point]) -> Claim:
    """Return the claim that the first point (default settings) is on the upper convex hull."""
    gap = measure_gap_to_hull(points[0], find_upper_hull(points))
    return Claim("distance of the default settings below the upper hull, dB", gap, 0.0)


def _change_step(config: EncoderConfig, factor: float) -> Changes:
    """Return changes that multiply the translation step and the rotation step by a factor."""
    unity = min(_scale_and_round(config.stream.rotation_unity, 1 / factor), ROTATION_UNITY_LIMIT)
    if config.steps.translation_error:
        step = ("steps.translation_error", f"{config.steps.translation_error * factor:g}")
    else:
        units = _scale_and_round(config.stream.translation_step, factor)
        step = ("stream.translation_step", f"{units}")
    return (step, ("stream.rotation_unity", f"{unity}"))


def _scale_and_round(number: int, factor: float) -> int:
    return max(1, round(number * factor))
