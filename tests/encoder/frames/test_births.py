"""Which Gaussians are cloned, and which new ones are split and pruned in training."""

import math

import pytest
import torch

from quarc_ref.encoder.frames.births import _make_keep_and_split_masks
from quarc_ref.encoder.frames.placement import place_clones
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.encoder.training.density import ScreenStatistics
from quarc_ref.encoder.training.trainable import Trainer, from_splats
from tests.encoder.toys import make_context, make_splats

_CPU = torch.device("cpu")


def _make_statistics(gradients, radii=None):
    gradients = torch.tensor(gradients)
    statistics = ScreenStatistics(len(gradients), _CPU)
    radii = torch.tensor(radii or [1.0] * len(gradients))
    statistics.restore({"sums": gradients, "views": torch.ones_like(gradients), "radii": radii})
    return statistics


def _make_scene(relative_scales, extent):
    """The first Gaussians of the toy scene, with scales relative to the extent along one axis."""
    scene = from_splats(make_splats(0), _CPU).rows(torch.arange(len(relative_scales)))
    scene.log_scales[:] = math.log(1e-3 * extent)
    scene.log_scales[:, 1] = torch.log(extent * torch.tensor(relative_scales))
    return scene


@pytest.mark.parametrize(("max_births", "expected"), [(9, [2, 4, 3, 1]), (3, [2, 4, 3])])
def test_small_gaussians_with_the_strongest_gradients_are_cloned(max_births, expected):
    context = make_context()
    scene = _make_scene([0.05, 0.05, 0.05, 0.05, 0.05, 0.2], context.views.extent)
    settings = BirthSettings(
        gate_views=0, grad_threshold=0.5, max_parent_scale=0.1, max_births=max_births,
        opacity_logit=0.25, spread=0.0,
    )  # fmt: skip
    gradients = [0.4, 0.5, 0.9, 0.7, 0.8, 5.0]

    clones, parents = place_clones(context, scene, 1, _make_statistics(gradients), settings)

    assert parents.tolist() == expected
    for name in ("means", "log_scales", "sh_dc", "sh_rest"):
        assert torch.equal(getattr(clones, name), getattr(scene, name)[expected])
    assert clones.opacities.tolist() == [0.25] * len(expected)
    assert clones.rotations.tolist() == [[1, 0, 0, 0]] * len(expected)


def test_where_nothing_changes_nothing_is_cloned(monkeypatch):
    context = make_context()
    picture = context.truth(0, 0)
    monkeypatch.setattr(type(context), "truth", lambda *_: picture)
    settings = BirthSettings(gate_views=1, grad_threshold=0.5, max_parent_scale=0.1)
    scene = _make_scene([0.05] * 3, context.views.extent)

    _, parents = place_clones(context, scene, 1, _make_statistics([1.0, 2.0, 3.0]), settings)

    assert not parents.numel()


@pytest.mark.parametrize(("room", "split"), [(0, []), (1, [1]), (2, [1, 2]), (9, [1, 2])])
def test_large_births_are_split_while_there_is_room_and_useless_ones_are_pruned(room, split):
    extent = 0.5
    scene = _make_scene([0.05, 0.2, 0.2, 0.2, 0.2, 0.2, 0.6], extent)
    scene.opacities[4] = -6.0
    statistics = _make_statistics(
        gradients=[1.0, 1.0, 1.0, 0.1, 0.1, 0.1, 0.1], radii=[1.0, 1.0, 1.0, 1.0, 1.0, 30.0, 1.0]
    )
    settings = BirthSettings(
        grad_threshold=0.5, max_parent_scale=0.1, max_births=7 + room,
        prune_opacity=0.01, prune_radius=20.0, prune_scale=0.5,
    )  # fmt: skip

    keep_mask, split_mask = _make_keep_and_split_masks(
        Trainer(scene, (0.1,) * 6), statistics, settings, extent
    )

    assert torch.nonzero(split_mask)[:, 0].tolist() == split
    kept = [row for row in (0, 1, 2, 3) if row not in split]
    assert torch.nonzero(keep_mask)[:, 0].tolist() == kept
