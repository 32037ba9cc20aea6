"""Defines the experiments of the paper: the trials of each, and the axis of its plot."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from paper.trials import FloatParts, Trial
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.format.constants import LATTICE_EXPONENT_LIMIT

STEP_FACTORS = (0.125, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
GRADIENT_FACTORS = (1, 2, 4, 8)
_LATTICE_DOUBLINGS = 3  # the finest step is then a whole number of lattice units
_LEVELS = (1, 2, 3)
_GAUSSIANS_PER_ANCHOR = (2, 4, 16, 24)
_RESAMPLE_INTERVALS = (1, 2, 4)
_REBINDING_INTERVAL = 4
_ROTATION_COMPONENTS = (3, 4)
_FULL_METHOD = "full"


@dataclass(frozen=True, slots=True)
class Point:
    """A trial of an experiment, with its position in the plot.

    Attributes:
        label: Description of the changed setting.
        x: Position on the x axis; None if the experiment has no x axis.
        trial: Trial to measure.
        series: Name of the curve to which the point belongs.
    """

    label: str
    x: float | None
    trial: Trial
    series: str = ""


@dataclass(frozen=True, slots=True)
class Experiment:
    """Trials that are compared with each other.

    Attributes:
        name: Name for the option `--only`.
        title: Title in tables and on the page.
        axis: Label of the x axis of the plot; if empty, the plot shows PSNR and births over the
            frames.
        points: Trials in the order of the tables.
        remark: Text below the title on the page.
    """

    name: str
    title: str
    axis: str
    points: tuple[Point, ...]
    remark: str = ""


def list_experiments(base_config: EncoderConfig, only: Sequence[str] = ()) -> list[Experiment]:
    """Return the experiments; their trials change settings of the full method.

    Args:
        base_config: Settings of the full method, with quantization steps in world units.
        only: Names of the experiments to return besides the full method; empty for all.

    Raises:
        ValueError: An experiment does not exist.
    """
    unknown_names = sorted(set(only) - set(EXPERIMENTS))
    if unknown_names:
        message = (
            f"unknown experiments: {', '.join(unknown_names)}; choose from {', '.join(EXPERIMENTS)}"
        )
        raise ValueError(message)
    requested = {_FULL_METHOD, *only} if only else set(EXPERIMENTS)
    return [
        make_experiment(base_config)
        for name, make_experiment in EXPERIMENTS.items()
        if name in requested
    ]


def list_trials(experiments: Sequence[Experiment]) -> list[Trial]:
    """Return all trials of the experiments, each once."""
    trials = {
        point.trial.name: point.trial for experiment in experiments for point in experiment.points
    }
    return list(trials.values())


def _make_full_experiment(base_config: EncoderConfig) -> Experiment:
    return Experiment(
        _FULL_METHOD,
        "Full method",
        "",
        (Point("full method", None, _make_full_trial(base_config)),),
    )


def _make_quantization_experiment(base_config: EncoderConfig) -> Experiment:
    config = _change_stream(base_config, "updates", value=False)
    points = (
        Point(
            "full method without updates" if base_config.stream.updates else "full method",
            None,
            _make_trial(base_config, "no-updates", config),
        ),
        Point(
            "motion and births in floats",
            None,
            _make_trial(base_config, "float-motion", config, "motion"),
        ),
        Point("all in floats", None, _make_trial(base_config, "float", config, "all")),
    )
    remark = (
        "Each float takes 4 bytes and is not entropy-coded. All three trials use the same seed and "
        "schedule, and none has updates of individual Gaussians, which are not in the paper."
    )
    return Experiment("quantization", "Quantization", "", points, remark)


def _make_gate_experiment(base_config: EncoderConfig) -> Experiment:
    remark = (
        "Apart from the gate, both trials use the paper's births: the Gaussians with the largest "
        "screen-space gradients are cloned and trained for 100 iterations, and as many Gaussians "
        "die as are born."
    )
    return Experiment("gate", "Change gate", "", _make_gate_points(base_config, 1), remark)


def _make_gradient_experiment(base_config: EncoderConfig) -> Experiment:
    points = [
        point for factor in GRADIENT_FACTORS for point in _make_gate_points(base_config, factor)
    ]
    axis = "minimum screen-space gradient of parents, relative to the paper's"
    remark = (
        "The paper's births, with and without the change gate. The paper chose its minimum "
        "gradient for pictures of 1352 x 1014. In smaller pictures, gradients are larger, and more "
        "Gaussians exceed the minimum."
    )
    return Experiment("gradient", "Change gate and minimum gradient", axis, tuple(points), remark)


def _make_gate_points(base_config: EncoderConfig, factor: int) -> tuple[Point, Point]:
    """Return the trials with and without the gate, with the minimum gradient times `factor`."""
    threshold = BirthSettings().grad_threshold * factor
    label_suffix, name_suffix = (
        (f", minimum gradient x {factor}", f"-{factor}") if factor != 1 else ("", "")
    )
    gate_config = replace(base_config, births=BirthSettings(grad_threshold=threshold))
    no_gate_config = replace(
        base_config, births=BirthSettings(grad_threshold=threshold, gate_views=0)
    )
    return (
        Point(
            f"change gate{label_suffix}",
            factor,
            _make_trial(base_config, f"gate{name_suffix}", gate_config),
            "change gate",
        ),
        Point(
            f"no gate{label_suffix}",
            factor,
            _make_trial(base_config, f"gate-open{name_suffix}", no_gate_config),
            "no gate",
        ),
    )


def _make_step_experiment(base_config: EncoderConfig) -> Experiment:
    points = [
        Point(
            f"step x {factor:g}",
            factor,
            _make_trial(base_config, f"step-{factor:g}", _change_step(base_config, factor)),
        )
        for factor in STEP_FACTORS
    ]
    axis = "translation step, relative to the full method"
    remark = (
        "Learning rates are the same in world units. A residual is at most 65 steps, so finer "
        "steps reduce the largest possible motion."
    )
    return Experiment("step", "Quantization step", axis, tuple(points), remark)


def _make_rebinding_experiment(base_config: EncoderConfig) -> Experiment:
    config = _change_stream(base_config, "updates", value=False)
    slow_resampling_config = _change_stream(config, "resample_interval", _REBINDING_INTERVAL)
    rebinding_trial = Trial("rebind", "rebind", slow_resampling_config, "all", rebinds=True)
    points = (
        Point(
            "anchors sampled and Gaussians bound in every frame",
            None,
            _make_frequent_resampling_trial(config),
        ),
        Point(
            "anchors sampled every 4 frames, binding kept",
            None,
            _make_trial(base_config, "keep", slow_resampling_config, "all"),
        ),
        Point(
            "anchors sampled every 4 frames, Gaussians bound in every frame", None, rebinding_trial
        ),
    )
    remark = (
        "All trials are in floats. In the format, the binding does not change between two "
        "samplings. The paper's released code binds every Gaussian again in every frame, to "
        "anchors at their sampled positions. Its sampler uses a random permutation from the GPU, "
        "which cannot be reproduced, so all trials use the sampler of the format."
    )
    return Experiment("rebinding", "Rebinding", "", points, remark)


def _make_frequent_resampling_trial(config: EncoderConfig) -> Trial:
    frequent_config = _change_stream(config, "resample_interval", 1)
    name = "float" if frequent_config == config else "float-resample-1"
    return _make_trial(config, name, frequent_config, "all")


def _define_sweep(
    name: str, title: str, setting: str, values: Sequence[int], axis: str
) -> Callable[[EncoderConfig], Experiment]:
    """Return a function that makes an experiment that compares several values of a setting."""

    def make_experiment(base_config: EncoderConfig) -> Experiment:
        points = [
            Point(
                f"{axis}: {value}",
                value,
                _make_trial(
                    base_config, f"{name}-{value}", _change_stream(base_config, setting, value)
                ),
            )
            for value in values
        ]
        return Experiment(name, title, axis, tuple(points))

    return make_experiment


def _make_full_trial(base_config: EncoderConfig) -> Trial:
    return Trial(_FULL_METHOD, _FULL_METHOD, base_config)


def _make_trial(
    base_config: EncoderConfig, name: str, config: EncoderConfig, floats: FloatParts = ""
) -> Trial:
    """Return a trial with these settings, which can be the trial of the full method."""
    if config == base_config and not floats:
        return _make_full_trial(base_config)
    return Trial(name, name.replace("-", " "), config, floats)


def _change_stream(base_config: EncoderConfig, setting: str, value: int) -> EncoderConfig:
    changes: dict[str, Any] = {setting: value}
    return replace(base_config, stream=replace(base_config.stream, **changes))


def _change_step(base_config: EncoderConfig, factor: float) -> EncoderConfig:
    """Return the settings with the translation step multiplied by `factor`.

    The lattice becomes finer so that it can represent finer steps. All other steps, and the
    learning rates in world units, do not change.
    """
    if factor == 1:
        return base_config
    doublings = min(
        _LATTICE_DOUBLINGS, LATTICE_EXPONENT_LIMIT - base_config.stream.lattice_exponent
    )
    step_in_units = base_config.stream.translation_step * factor * 2**doublings
    stream = replace(
        base_config.stream,
        lattice_exponent=base_config.stream.lattice_exponent + doublings,
        position_step=base_config.stream.position_step << doublings,
        translation_step=max(1, round(step_in_units)),
    )
    return replace(base_config, stream=stream)


EXPERIMENTS: dict[str, Callable[[EncoderConfig], Experiment]] = {
    _FULL_METHOD: _make_full_experiment,
    "quantization": _make_quantization_experiment,
    "gate": _make_gate_experiment,
    "gradient": _make_gradient_experiment,
    "step": _make_step_experiment,
    "levels": _define_sweep("levels", "Anchor levels", "level_count", _LEVELS, "anchor levels"),
    "anchors": _define_sweep(
        "anchors",
        "Gaussians per anchor",
        "gaussians_per_anchor",
        _GAUSSIANS_PER_ANCHOR,
        "Gaussians per anchor",
    ),
    "resample": _define_sweep(
        "resample",
        "Resampling",
        "resample_interval",
        _RESAMPLE_INTERVALS,
        "resampling interval in frames",
    ),
    "rotation": _define_sweep(
        "rotation",
        "Symbols per rotation",
        "rotation_components",
        _ROTATION_COMPONENTS,
        "symbols per rotation",
    ),
    "rebinding": _make_rebinding_experiment,
}
