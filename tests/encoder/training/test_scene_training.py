"""Single iterations of the training of frame 0."""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from quarc_ref.encoder.settings.presets import choose_preset
from quarc_ref.encoder.training import scene_training
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import Observers
from quarc_ref.encoder.training.regularizers import code_rate_nats
from quarc_ref.encoder.training.scene_training import SceneTraining
from tests.encoder.toys import SMALL, make_capture, make_context


def test_the_rate_of_the_codes_has_twice_its_weight_in_the_iterations_that_use_it():
    losses = []
    recorder = SimpleNamespace(step=lambda step: losses.append(step.loss()))
    context = replace(make_context(), observers=Observers(monitor=recorder))
    for weight in (0.0, 0.01):
        settings = replace(SMALL.canonical, code_rd_lambda=weight)
        objective = CanonicalObjective(settings, SMALL.stream, rd_factor=0.5)
        training = SceneTraining(context, make_capture().points, objective, 0)
        nats = float(code_rate_nats(training.attributes, SMALL.stream, has_sh_rest=False))
        training.take_step()

    assert losses[1] == pytest.approx(losses[0] * (1 + 2 * 0.5 * 0.01 * nats), rel=1e-5)


def test_the_docstring_states_the_schedule_of_main():
    config = choose_preset("main")
    settings, objective = config.canonical, CanonicalObjective(config.canonical, config.stream)
    steps = range(settings.iterations)
    tuned, pseudo = steps[settings.fine_tuning_start :], settings.pseudo_view_steps
    densified = [step for step in steps if objective.should_densify(step)]
    decayed = [step for step in steps if objective.should_decay_opacity(step)]
    prunings = [step for step in steps if objective.pruning_at(step, 100)]
    *early, last_early = (step for step in prunings if step < settings.densification_end)
    late = [step for step in prunings if step >= settings.densification_end]
    (choice,) = (step for step in steps if objective.should_choose_codes(step))
    every = settings.densification_interval
    early = f"prunings at {', '.join(map(str, early))} and {last_early}"
    expected = [
        (steps[: settings.half_resolution_until_iter], "pictures of half the width and height"),
        (steps[: tuned[0]], "noise along the axes"),
        (steps[settings.exposure_from_iter :], "exposures"),
        (densified, f"densification, every {every} iterations; {early}"),
        (decayed, "opacity decay"),
        (pseudo, "pseudo-views"),
        (steps[settings.sh_from_iter :], "SH degree 1, if the stream has it (not in `main`)"),
        (late, f"{len(late)} prunings by threshold"),
        (tuned, f"fine-tuning; choice of codes at {choice}"),
    ]

    first_line, _, *lines = scene_training.__doc__.partition("Schedule of ")[2].splitlines()

    assert first_line.endswith(f"one end at iteration {pseudo[0]}:")
    assert [line.strip() for line in lines if line] == [
        f"{f'{span[0]} to {span[-1]}':15} {text}" for span, text in expected
    ]
    assert config.stream.sh_degree == 0


def _measure_noise(step, **settings):
    """The deviation of rendered positions in an iteration, in world units and relative to scales.

    The Gaussians are those of the initial points.
    """
    objective = CanonicalObjective(replace(SMALL.canonical, **settings), SMALL.stream)
    training = SceneTraining(make_context(), make_capture().points, objective, 0)
    training.step = step
    initial = training.attributes
    noise = training._attributes_to_render().means.detach() - initial.means
    return float(noise.std()), float((noise / initial.log_scales.exp()).std())


@pytest.mark.parametrize(("step", "share"), [(0, 1.0), (60, 0.25)])
def test_noise_has_its_deviation_and_that_along_the_axes_decreases(step, share):
    deviation, _ = _measure_noise(step, position_noise=0.03)
    assert deviation == pytest.approx(0.03, rel=0.15)

    _, relative_deviation = _measure_noise(step, axis_noise=0.2, quantize_from=0.8)
    assert relative_deviation == pytest.approx(0.2 * share, rel=0.15)
