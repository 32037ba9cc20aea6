"""The paper's experiments: the trials of each, and the axis along which they differ."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from paper.trials import Floats, Trial
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.format.constants import LATTICE_EXPONENT_LIMIT

STEP_FACTORS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
GRADIENT_FACTORS = (1, 2, 4, 8)
_STEP_DOUBLINGS = 3  # of the lattice, for which the finest step is a whole number of units
_LEVELS = (1, 2, 3)
_GAUSSIANS_PER_ANCHOR = (2, 4, 16, 24)
_RESAMPLE_INTERVALS = (1, 2, 4)
_REBINDING_INTERVAL = 4
_ROTATION_COMPONENTS = (3, 4)
_FULL = "full"


@dataclass(frozen=True, slots=True)
class Point:
    """Place of a trial in an experiment.

    Attributes:
        label: What is changed.
        x: Position along the axis; None without an axis.
        trial: What is measured.
        series: Name of the curve to which the point belongs.
    """

    label: str
    x: float | None
    trial: Trial
    series: str = ""


@dataclass(frozen=True, slots=True)
class Experiment:
    """Trials to compare.

    Attributes:
        name: For `--only`.
        title: For people.
        axis: Label of the axis; empty without an axis.
        points: In order.
        remark: Remark for readers.
    """

    name: str
    title: str
    axis: str
    points: tuple[Point, ...]
    remark: str = ""


def list_experiments(base: EncoderConfig, only: Sequence[str] = ()) -> list[Experiment]:
    """Return the experiments around given settings.

    Args:
        base: Settings of the full method, with steps in world units.
        only: Names of the requested experiments besides the full method; None for all.

    Raises:
        ValueError: An experiment does not exist.
    """
    unknown = sorted(set(only) - set(EXPERIMENTS))
    if unknown:
        message = f"no experiment {', '.join(unknown)}; there are {', '.join(EXPERIMENTS)}"
        raise ValueError(message)
    wanted = {_FULL, *only} if only else set(EXPERIMENTS)
    return [make(base) for name, make in EXPERIMENTS.items() if name in wanted]


def list_trials(experiments: Sequence[Experiment]) -> list[Trial]:
    """Return all trials of experiments, each once."""
    trials = {point.trial.name: point.trial for each in experiments for point in each.points}
    return list(trials.values())


def _make_full(base: EncoderConfig) -> Experiment:
    return Experiment(_FULL, "Full method", "", (Point("full method", None, _full(base)),))


def _make_quantization(base: EncoderConfig) -> Experiment:
    points = (
        Point("full method", None, _full(base)),
        Point("motion and births in floats", None, _try(base, "float-motion", base, "motion")),
        Point("all in floats", None, _try(base, "float", base, "all")),
    )
    remark = (
        "Sizes of floats are 4 bytes for each number, without coding. "
        "All three scenes use the same seed and schedule."
    )
    return Experiment("quantization", "Quantization", "", points, remark)


def _make_gate(base: EncoderConfig) -> Experiment:
    remark = (
        "Both with the paper's births in all else: clones of the Gaussians of the largest screen "
        "gradient, 100 iterations, and as many deaths as births."
    )
    return Experiment("gate", "Change gate", "", _with_and_without_gate(base, 1), remark)


def _make_gradient(base: EncoderConfig) -> Experiment:
    points = [
        point for factor in GRADIENT_FACTORS for point in _with_and_without_gate(base, factor)
    ]
    axis = "least screen gradient of a parent, times the paper's"
    remark = (
        "The paper's births with and without the change gate. Its least gradient is one for "
        "pictures of 1352 x 1014; in smaller ones a Gaussian has a larger share, and more of "
        "them pass."
    )
    return Experiment("gradient", "Change gate and least gradient", axis, tuple(points), remark)


def _with_and_without_gate(base: EncoderConfig, factor: int) -> tuple[Point, Point]:
    """Return the paper's births with multiples of its least gradient, with and without the gate."""
    gradient = BirthSettings().grad_threshold * factor
    above, ending = (f", gradient x {factor}", f"-{factor}") if factor != 1 else ("", "")
    gated = replace(base, births=BirthSettings(grad_threshold=gradient))
    opened = replace(base, births=BirthSettings(grad_threshold=gradient, gate_views=0))
    return (
        Point(f"change gate{above}", factor, _try(base, f"gate{ending}", gated), "change gate"),
        Point(f"no gate{above}", factor, _try(base, f"gate-open{ending}", opened), "no gate"),
    )


def _make_step(base: EncoderConfig) -> Experiment:
    points = [
        Point(
            f"step x {factor:g}",
            factor,
            _try(base, f"step-{factor:g}", _change_step(base, factor)),
        )
        for factor in STEP_FACTORS
    ]
    axis = "step of translations, times that of the full method"
    remark = (
        "Learning rates in world units stay what they are. A residual is at most 65 steps, so "
        "that the finest steps reach least far."
    )
    return Experiment("step", "Quantization step", axis, tuple(points), remark)


def _make_rebinding(base: EncoderConfig) -> Experiment:
    slow = _change_stream(base, "resample_interval", _REBINDING_INTERVAL)
    redone = Trial("rebind", "rebind", slow, "all", rebinds=True)
    points = (
        Point("sampled and bound in every frame", None, _every_frame(base)),
        Point("sampled every 4 frames, binding kept", None, _try(base, "keep", slow, "all")),
        Point("sampled every 4 frames, bound in every frame", None, redone),
    )
    remark = (
        "All in floats. Kept is the format's rule; bound in every frame to anchors that stay where "
        "they were is the release's, and not in the format. The release's sampler, a grid of "
        "points and a fill drawn by a GPU's permutation, cannot be drawn again from its text and "
        "is left out."
    )
    return Experiment("rebinding", "Rebinding", "", points, remark)


def _every_frame(base: EncoderConfig) -> Trial:
    config = _change_stream(base, "resample_interval", 1)
    return _try(base, "float" if config == base else "float-resample-1", config, "all")


def _sweep(
    name: str, title: str, setting: str, values: Sequence[int], axis: str
) -> Callable[[EncoderConfig], Experiment]:
    """Return a function that makes an experiment of one integer field of the header."""

    def make(base: EncoderConfig) -> Experiment:
        points = [
            Point(
                f"{axis}: {value}",
                value,
                _try(base, f"{name}-{value}", _change_stream(base, setting, value)),
            )
            for value in values
        ]
        return Experiment(name, title, axis, tuple(points))

    return make


def _full(base: EncoderConfig) -> Trial:
    return Trial(_FULL, _FULL, base)


def _try(base: EncoderConfig, name: str, config: EncoderConfig, floats: Floats = "") -> Trial:
    """Return a trial; that of the full method if nothing is changed."""
    if config == base and not floats:
        return _full(base)
    return Trial(name, name.replace("-", " "), config, floats)


def _change_stream(base: EncoderConfig, setting: str, value: int) -> EncoderConfig:
    changed: dict[str, Any] = {setting: value}
    return replace(base, stream=replace(base.stream, **changed))


def _change_step(base: EncoderConfig, factor: float) -> EncoderConfig:
    """Return settings with a multiple of the translation step, and unchanged learning rates.

    The lattice becomes finer to allow this; no other step changes.
    """
    if factor == 1:
        return base
    motion = replace(base.motion, translation_lr=base.motion.translation_lr / factor)
    finer = min(_STEP_DOUBLINGS, LATTICE_EXPONENT_LIMIT - base.stream.lattice_exponent)
    units = base.stream.translation_step * factor * 2**finer
    stream = replace(
        base.stream,
        lattice_exponent=base.stream.lattice_exponent + finer,
        position_step=base.stream.position_step << finer,
        translation_step=max(1, round(units)),
    )
    return replace(base, motion=motion, stream=stream)


EXPERIMENTS: dict[str, Callable[[EncoderConfig], Experiment]] = {
    _FULL: _make_full,
    "quantization": _make_quantization,
    "gate": _make_gate,
    "gradient": _make_gradient,
    "step": _make_step,
    "levels": _sweep("levels", "Levels of anchors", "level_count", _LEVELS, "levels"),
    "anchors": _sweep(
        "anchors",
        "Gaussians to an anchor",
        "gaussians_per_anchor",
        _GAUSSIANS_PER_ANCHOR,
        "Gaussians to an anchor",
    ),
    "resample": _sweep(
        "resample",
        "Resampling",
        "resample_interval",
        _RESAMPLE_INTERVALS,
        "frames from one sampling to the next",
    ),
    "rotation": _sweep(
        "rotation",
        "Symbols of a rotation",
        "rotation_components",
        _ROTATION_COMPONENTS,
        "symbols of a rotation",
    ),
    "rebinding": _make_rebinding,
}
