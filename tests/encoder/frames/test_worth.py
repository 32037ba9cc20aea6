from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.encoder.frames.worth import Stage, keep_worthy, measure_gains
from quarc_ref.encoder.training.fixed_scene import FixedScene
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.trainable import Attributes, from_splats, to_sh_dc
from quarc_ref.format.coding.gaussian_planes import write_births
from quarc_ref.rendering.pictures import render_picture
from tests.encoder.toys import SMALL, make_splats, make_studio

_CPU = torch.device("cpu")
_PARENTS = torch.tensor([3, 9, 20])


def _blobs() -> Attributes:
    """Three blobs before the scene: two red ones, and between them a green one."""
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
def stage(monkeypatch) -> Stage:
    """A stage whose truth is the scene with the red blobs."""
    studio, header = make_studio(), SMALL.stream
    state = begin_canonical(
        header, 0, quantize_gaussians(from_splats(make_splats(0), _CPU), header)
    )
    scene = from_splats(dequantize(state.scene), _CPU)
    red = _blobs().rows(torch.tensor([0, 2])).quantized(header)
    with torch.no_grad():
        drawn = scene.joined(red).activated()
        truths = [studio.render(drawn, view).image for view in range(len(studio.views.cameras))]
    monkeypatch.setattr(type(studio), "truth", lambda *asked: truths[asked[1]])
    return Stage(
        studio,
        SMALL,
        state,
        FixedScene(studio, scene),
        lambda births: write_births(births, state.birth_counts).byte_count(),
    )


def _priced(stage: Stage, price: float) -> Stage:
    """The stage where a byte must take so much off the loss."""
    births = replace(stage.config.births, rd_lambda=price * stage.state.scene.count)
    return replace(stage, config=replace(stage.config, births=births))


def test_what_is_missing_is_worth_most_and_what_is_wrong_less_than_nothing(stage):
    large, wrong, small = measure_gains(stage, _blobs()).tolist()

    assert large > small > 0 > wrong


def test_a_newborns_worth_is_near_to_what_the_loss_falls_by(stage):
    red = _blobs().rows(torch.tensor([0]))

    fall = stage.mean_loss_without() - stage.mean_loss(red)
    assert float(measure_gains(stage, red)) == pytest.approx(fall, rel=0.5)


def test_those_that_do_not_pay_are_left_out_and_the_others_stay(stage):
    births = keep_worthy(_priced(stage, 1e-9), _blobs(), _PARENTS)

    assert births is not None
    assert births.parents.tolist() == [3, 20]


def test_no_one_is_born_where_bytes_are_too_dear(stage):
    assert keep_worthy(_priced(stage, 1.0), _blobs(), _PARENTS) is None


def test_all_stay_or_none_where_bytes_cost_nothing(stage):
    births = keep_worthy(_priced(stage, 0), _blobs(), _PARENTS)
    wrong = torch.tensor([1])

    assert births is not None
    assert births.parents.tolist() == _PARENTS.tolist()
    assert keep_worthy(_priced(stage, 0), _blobs().rows(wrong), _PARENTS[wrong]) is None


def test_what_they_gain_is_set_against_the_bytes_of_their_section(stage):
    red = _blobs().rows(torch.tensor([0, 2]))
    born = keep_worthy(stage, red, _PARENTS[[0, 2]])
    assert born is not None
    gain = stage.mean_loss_without() - stage.mean_loss(red)
    even = gain / write_births(born, stage.state.birth_counts).byte_count()

    first = torch.tensor([0])
    assert keep_worthy(_priced(stage, 1.5 * even), red.rows(first), _PARENTS[first]) is None
    assert keep_worthy(_priced(stage, 0.2 * even), red, _PARENTS[[0, 2]]) is not None


def test_the_scene_is_as_the_decoder_has_it(stage):
    splats = dequantize(stage.state.scene)
    picture = render_picture(splats, stage.studio.camera(0))

    assert np.allclose(stage.scene.seen_by(0).image.numpy(), picture, atol=1e-4)
