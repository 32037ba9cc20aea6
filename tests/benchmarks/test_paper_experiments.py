import math
from dataclasses import replace

import pytest

from paper.experiments import (
    EXPERIMENTS,
    GRADIENT_FACTORS,
    STEP_FACTORS,
    list_experiments,
    list_trials,
)
from quarc_ref.encoder.settings.config import StepSettings
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.encoder.settings.presets import PRESETS
from quarc_ref.encoder.training.straight_through import position_step, translation_step

BASE_CONFIGS = {name: replace(config, steps=StepSettings()) for name, config in PRESETS.items()}


def _list_points(base, name):
    *_, experiment = list_experiments(base, [name])
    return experiment.points


@pytest.mark.parametrize("base", BASE_CONFIGS.values(), ids=BASE_CONFIGS)
def test_all_experiments_of_the_paper_are_listed_and_each_trial_once(base):
    experiments = list_experiments(base)
    trials = list_trials(experiments)

    assert [experiment.name for experiment in experiments] == list(EXPERIMENTS)
    assert len({trial.name for trial in trials}) == len(trials)
    trial_inputs = {(trial.config, trial.floats, trial.rebinds) for trial in trials}
    assert len(trial_inputs) == len(trials)
    assert sum(trial.config == base and not trial.floats for trial in trials) == 1


@pytest.mark.parametrize("base", BASE_CONFIGS.values(), ids=BASE_CONFIGS)
def test_the_sweep_changes_only_the_step_of_translations_in_world_units(base):
    points = _list_points(base, "step")

    assert [point.x for point in points] == list(STEP_FACTORS)
    assert len(points) == 7
    for point in points:
        stream = point.trial.config.stream
        expected_step = point.x * translation_step(base.stream)
        assert math.isclose(translation_step(stream), expected_step)
        assert position_step(stream) == position_step(base.stream)
        assert point.trial.config.motion == base.motion
    assert points[3].trial.config == base


def test_the_full_method_is_included_if_another_experiment_is_selected():
    experiments = list_experiments(BASE_CONFIGS["main"], ["gate"])
    assert [experiment.name for experiment in experiments] == ["full", "gate"]


def test_trials_with_the_same_least_gradient_differ_only_in_the_gate():
    births = [point.trial.config.births for point in _list_points(BASE_CONFIGS["demo"], "gradient")]

    assert births[::2] == [
        BirthSettings(grad_threshold=BirthSettings().grad_threshold * factor)
        for factor in GRADIENT_FACTORS
    ]
    assert births[1::2] == [replace(settings, gate_views=0) for settings in births[::2]]
    gate_trials = [point.trial for point in _list_points(BASE_CONFIGS["demo"], "gate")]
    assert gate_trials == [
        point.trial for point in _list_points(BASE_CONFIGS["demo"], "gradient")[:2]
    ]


def test_a_value_of_the_full_method_shares_its_row():
    for name, point_index in (("levels", 2), ("anchors", 0), ("rotation", 0), ("resample", 0)):
        assert _list_points(BASE_CONFIGS["main"], name)[point_index].trial.name == "full"
    assert _list_points(BASE_CONFIGS["paper"], "gate")[0].trial.name == "full"
    assert _list_points(BASE_CONFIGS["paper"], "rotation")[1].trial.name == "full"


@pytest.mark.parametrize(("preset", "quantized_name"), [("paper", "full"), ("main", "no-updates")])
def test_trials_in_floats_are_compared_with_a_trial_that_has_no_updates_either(
    preset, quantized_name
):
    trials = [point.trial for point in _list_points(BASE_CONFIGS[preset], "quantization")]

    assert [trial.name for trial in trials] == [quantized_name, "float-motion", "float"]
    assert len({trial.config for trial in trials}) == 1
    assert not trials[0].config.stream.updates


def test_rebinding_is_tried_in_floats_against_the_same_method_without_it():
    resampled, not_rebound, rebound = (
        point.trial for point in _list_points(BASE_CONFIGS["paper"], "rebinding")
    )

    assert {resampled.floats, not_rebound.floats, rebound.floats} == {"all"}
    assert not_rebound.config == rebound.config
    assert (not_rebound.rebinds, rebound.rebinds) == (False, True)
    assert resampled.config.stream.resample_interval == 1


def test_an_unknown_experiment_is_rejected():
    with pytest.raises(
        ValueError, match="unknown experiments: stepp; choose from full, quantization"
    ):
        list_experiments(BASE_CONFIGS["main"], ["full", "stepp"])
