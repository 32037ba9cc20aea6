import numpy as np
import pytest
import torch

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.encoder.frames.birth_selection import (
    BirthObjective,
    ByteCost,
    estimate_gains,
    select_births,
)
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.trainable import Attributes, from_splats, to_sh_dc
from quarc_ref.format.coding.gaussian_planes import write_births
from quarc_ref.format.records import Births, Gaussians
from quarc_ref.rendering.pictures import render_picture
from tests.encoder.toys import SMALL, make_context, make_splats

_CPU = torch.device("cpu")
_PARENTS = torch.tensor([3, 9, 20])


def _make_blobs() -> Attributes:
    """Return three Gaussians in front of the scene: red, green and red."""
    colors = torch.tensor([[0.9, 0.1, 0.1], [0.1, 0.9, 0.1], [0.9, 0.1, 0.1]])
    return Attributes(
        torch.tensor([[0.2, -0.1, -1.2], [-0.3, 0.3, -1.2], [-0.3, -0.4, -1.2]]),
        torch.tensor([1.0, 0.0, 0.0, 0.0]).repeat(3, 1),
        torch.log(torch.tensor([0.1, 0.1, 0.05]))[:, None].repeat(1, 3),
        torch.full((3,), 2.0),
        to_sh_dc(colors)[:, None],
        torch.zeros(3, 3, 3),
    )


@pytest.fixture
def objective(monkeypatch) -> BirthObjective:
    """A birth objective whose ground truth is the scene plus the red Gaussians."""
    context, header = make_context(), SMALL.stream
    state = begin_canonical(
        header, 0, quantize_gaussians(from_splats(make_splats(0), _CPU), header)
    )
    scene = from_splats(dequantize(state.scene), _CPU)
    red = _make_blobs().rows(torch.tensor([0, 2])).quantized(header)
    with torch.no_grad():
        gaussians = scene.joined(red).activated()
        truths = [
            context.render(gaussians, view).image for view in range(len(context.views.cameras))
        ]
    monkeypatch.setattr(type(context), "truth", lambda *arguments: truths[arguments[1]])
    return BirthObjective(
        context, FixedScene(context, scene), state.scene, SMALL.motion.lambda_dssim
    )


def _count_bytes(objective: BirthObjective, births: Births) -> int:
    gaussians = Gaussians(
        *(np.zeros((rows, 1), np.int64) for rows in (3, 4, SMALL.stream.code_planes))
    )
    counts = begin_canonical(objective.decoded_scene.header, 0, gaussians).birth_counts
    return write_births(births, counts).byte_count()


def _cost(objective: BirthObjective, weight: float) -> ByteCost:
    """Return a byte cost in which each byte must lower the loss by `weight`."""
    return ByteCost(weight, lambda births: _count_bytes(objective, births))


def test_missing_gaussians_gain_most_and_wrong_ones_less_than_nothing(objective):
    large, wrong, small = estimate_gains(objective, _make_blobs()).tolist()

    assert large > small > 0 > wrong


def test_the_gain_of_a_newborn_is_close_to_the_decrease_of_the_loss(objective):
    red = _make_blobs().rows(torch.tensor([0]))

    decrease = objective.mean_loss_without_births() - objective.mean_loss(red)
    assert float(estimate_gains(objective, red)) == pytest.approx(decrease, rel=0.5)


def test_births_that_gain_too_little_are_left_out_and_the_others_stay(objective):
    births = select_births(objective, _make_blobs(), _PARENTS, _cost(objective, 1e-9))

    assert births is not None
    assert births.parents.tolist() == [3, 20]


def test_a_high_lambda_allows_no_births(objective):
    assert select_births(objective, _make_blobs(), _PARENTS, _cost(objective, 1.0)) is None


def test_without_a_cost_of_bytes_all_births_or_none_stay(objective):
    births = select_births(objective, _make_blobs(), _PARENTS, _cost(objective, 0))
    wrong_index = torch.tensor([1])

    assert births is not None
    assert births.parents.tolist() == _PARENTS.tolist()
    assert (
        select_births(
            objective, _make_blobs().rows(wrong_index), _PARENTS[wrong_index], _cost(objective, 0)
        )
        is None
    )


def test_gains_are_compared_with_the_bytes_of_the_section(objective):
    red = _make_blobs().rows(torch.tensor([0, 2]))
    births = select_births(objective, red, _PARENTS[[0, 2]], _cost(objective, 0.0))
    assert births is not None
    gain = objective.mean_loss_without_births() - objective.mean_loss(red)
    break_even_weight = gain / _count_bytes(objective, births)

    first = torch.tensor([0])
    assert (
        select_births(
            objective, red.rows(first), _PARENTS[first], _cost(objective, 1.5 * break_even_weight)
        )
        is None
    )
    assert (
        select_births(objective, red, _PARENTS[[0, 2]], _cost(objective, 0.2 * break_even_weight))
        is not None
    )


def test_the_scene_equals_the_decoders(objective):
    splats = dequantize(objective.decoded_scene)
    picture = render_picture(splats, objective.context.camera(0))

    assert np.allclose(objective.fixed_scene.backdrop(0).image.numpy(), picture, atol=1e-4)
