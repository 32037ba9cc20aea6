import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.encoder.rotations import code_quaternions, multiply
from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.axes import rename_axes
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.code_rates import CodeRates
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.rdoq import choose_codes, choose_colors, choose_rotations
from quarc_ref.encoder.training.sensitivity import measure_sensitivities
from quarc_ref.encoder.training.trainable import Attributes, Trainer, to_columns, to_rows
from quarc_ref.format.coding.gaussian_planes import sort_canonical, write_canonical
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader
from tests.encoder.toys import make_context, make_splats

_HEADER = StreamHeader(rotation_bits=6, log_scale_step=1 / 8, sh_dc_step=1 / 16)
_BITS = _HEADER.rotation_bits


@pytest.fixture(scope="module")
def context():
    return make_context()


@pytest.fixture
def attributes():
    """The toy scene, with flat Gaussians that point in random directions."""
    splats, generator = make_splats(0), torch.Generator().manual_seed(0)
    count = len(splats.positions)
    return Attributes(
        torch.from_numpy(splats.positions),
        torch.randn(count, 4, generator=generator),
        torch.from_numpy(splats.log_scales) - torch.rand(count, 3, generator=generator),
        torch.from_numpy(splats.opacities) - 3,
        torch.from_numpy(splats.sh),
        torch.zeros(count, 3, 3),
    )


def _generator():
    return torch.Generator().manual_seed(1)


def _covariances(attributes):
    w, x, y, z = torch.nn.functional.normalize(attributes.rotations.double(), dim=1).unbind(1)
    matrices = torch.stack(
        [
            torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], 1),
            torch.stack([2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)], 1),
            torch.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1),
        ],
        dim=1,
    )
    scaled = matrices * attributes.log_scales.double().exp()[:, None, :]
    return scaled @ scaled.transpose(1, 2)


def _count_bytes(gaussians):
    origin, _, ordered = sort_canonical(gaussians)
    return sum(section.byte_count() for section in write_canonical(ordered, origin))


def _repeat(attributes, count):
    return Attributes(
        *(tensor.repeat(count, *[1] * (tensor.ndim - 1)) for tensor in attributes.tensors())
    )


def test_renamed_axes_are_those_of_the_same_gaussian(attributes):
    renamed, axes = rename_axes(attributes, _HEADER)

    torch.testing.assert_close(_covariances(renamed), _covariances(attributes), atol=1e-7, rtol=0)
    torch.testing.assert_close(renamed.log_scales, attributes.log_scales.gather(1, axes))
    torch.testing.assert_close(renamed.rotations.norm(dim=1), attributes.rotations.norm(dim=1))
    assert (axes.sort(dim=1).values == torch.arange(3)).all()
    assert (axes != torch.arange(3)).any()


def test_renamed_axes_take_fewer_bytes(attributes):
    many = _repeat(attributes, 20)
    many.rotations[:] = torch.randn(many.rotations.shape, generator=_generator())

    renamed, _ = rename_axes(many, _HEADER)

    before, after = (quantize_gaussians(each, _HEADER) for each in (many, renamed))
    # Of the 24 combinations, log2(24) = 4.6 bits are saved, less what the estimate misses.
    saved_bits = 8 * (_count_bytes(before) - _count_bytes(after)) / before.count
    assert 3 < saved_bits < 4.6


def test_axes_with_the_fewest_bits_are_kept(attributes):
    attributes = replace(attributes, rotations=torch.eye(4)[:1].repeat(len(attributes.means), 1))

    renamed, axes = rename_axes(attributes, _HEADER)

    # All rotations are 0, so only an order of scales could save bits, but it would cost rotations.
    assert (axes == torch.arange(3)).float().mean() > 0.95
    torch.testing.assert_close(_covariances(renamed), _covariances(attributes), atol=1e-7, rtol=0)


def test_rates_are_those_of_an_ideal_coder():
    rng = np.random.default_rng(0)
    codes = np.stack([rng.geometric(0.3, 20_000), rng.integers(-8, 8, 20_000)])

    bits = CodeRates(codes).bits(codes)

    shares = 0.3 * 0.7 ** np.arange(100)
    entropy = -(shares * np.log2(shares)).sum() + 4
    assert entropy - 0.02 < bits.mean() < entropy + 0.15
    unseen = CodeRates(codes).bits(np.array([[1, 500, -500], [0, 0, 0]]))
    assert unseen[0] + 10 < unseen[1] < 50
    assert unseen[0] + 10 < unseen[2] < 50


def test_sensitivities_predict_the_change_of_the_pictures(context, attributes):
    attributes = replace(
        attributes, rotations=torch.nn.functional.normalize(attributes.rotations, dim=1)
    )
    estimates = [measure_sensitivities(context, attributes, _generator_of(k)) for k in range(30)]
    turn, shift = torch.tensor([1.0, 0.02, -0.03, 0.01]), torch.tensor([0.03, -0.02, 0.04])
    products = multiply(to_columns(attributes.rotations), turn[:, None].numpy())
    turned = replace(attributes, rotations=to_rows(products, attributes.rotations))
    recolored = replace(attributes, sh_dc=attributes.sh_dc + shift)

    for changed, name, change in ((turned, "rotations", turn[1:]), (recolored, "colors", shift)):
        forms = np.mean([getattr(estimate, name) for estimate in estimates], axis=0)
        predicted = np.einsum("i,nij,j->n", change, forms, change)
        sampled = np.argsort(predicted)[-40::4]
        measured = [_change_of_pictures(context, attributes, changed, index) for index in sampled]
        np.testing.assert_allclose(predicted[sampled], measured, rtol=0.25)


def test_free_codes_are_the_nearest():
    rng = np.random.default_rng(0)
    quaternions, colors = rng.normal(size=(4, 500)), rng.normal(size=(3, 500))
    forms = np.tile(np.eye(3), (500, 1, 1))

    np.testing.assert_array_equal(choose_rotations(quaternions, forms, _BITS, 0.0), quaternions)
    np.testing.assert_array_equal(choose_colors(colors, forms, 1 / 16, 0.0), colors)


def test_with_a_higher_weight_codes_take_fewer_bits_and_change_more():
    rng = np.random.default_rng(0)
    quaternions = np.concatenate([np.ones((1, 2000)), rng.normal(scale=0.3, size=(3, 2000))])
    colors = rng.normal(size=(3, 2000))
    forms = np.tile(np.eye(3), (2000, 1, 1))
    forms[:1000] *= 100
    unit = quaternions / np.linalg.norm(quaternions, axis=0)

    bits, changes = [], []
    for rd_lambda in (0.0, 1e-4, 1e-3, 3e-2):
        chosen = choose_rotations(quaternions, forms, _BITS, rd_lambda)
        chosen /= np.linalg.norm(chosen, axis=0)
        codes = code_quaternions(chosen, _BITS)
        recolored = choose_colors(colors, forms, 1 / 16, rd_lambda)
        color_codes = np.rint(recolored * 16).astype(np.int64)
        bits.append(
            CodeRates(codes).bits(codes).mean() + CodeRates(color_codes).bits(color_codes).mean()
        )
        change = np.abs(chosen - unit).max(axis=0)
        changes.append((change[:1000].mean(), change[1000:].mean()))

    assert bits == sorted(bits, reverse=True)
    assert bits[0] - bits[-1] > 3
    sensitive, insensitive = zip(*changes, strict=True)
    assert list(insensitive) == sorted(insensitive)
    assert list(sensitive) == sorted(sensitive)
    assert sensitive[-1] < 0.5 * insensitive[-1]


def test_codes_of_training_take_fewer_bytes_and_give_similar_pictures(context, attributes):
    objective = CanonicalObjective(CanonicalSettings(quantize_rd_lambda=0.001), _HEADER)
    trainer = Trainer(attributes, (1e-3,) * 6)
    _train(trainer, context)
    before = trainer.attributes.detached()
    second_moments = trainer.state()["means.exp_avg_sq"]
    choose_codes(trainer, context, objective, _generator())
    after = trainer.attributes.detached()

    sizes = [_count_bytes(quantize_gaussians(each, _HEADER)) for each in (before, after)]
    assert sizes[1] < 0.97 * sizes[0]
    rounding, choice = (
        _distance(context, before, each.quantized(_HEADER)) for each in (before, after)
    )
    assert choice < 2 * rounding
    assert (after.sh_dc != before.sh_dc).any()
    for name in ("means", "opacities", "sh_rest"):
        torch.testing.assert_close(getattr(after, name), getattr(before, name), rtol=0, atol=0)
    assert trainer.state()["means.exp_avg_sq"] is second_moments
    assert float(trainer.state()["rotations.exp_avg"].abs().max()) == 0
    assert float(trainer.state()["rotations.exp_avg_sq"].min()) >= 0
    _train(trainer, context)


def test_gaussians_that_no_view_sees_do_no_harm(context, attributes):
    attributes.means[:] = torch.tensor([0.0, 0.0, -1e3])
    objective = CanonicalObjective(CanonicalSettings(quantize_rd_lambda=0.01), _HEADER)
    trainer = Trainer(attributes, (1e-3,) * 6)

    choose_codes(trainer, context, objective, _generator())

    assert all(bool(tensor.isfinite().all()) for tensor in trainer.attributes.tensors())


@pytest.mark.parametrize(
    ("name", "value"), [("rotations", math.nan), ("log_scales", math.inf), ("sh_dc", 1e9)]
)
def test_attributes_without_codes_are_an_error(name, value, context, attributes):
    getattr(attributes, name)[3] = value
    objective = CanonicalObjective(CanonicalSettings(quantize_rd_lambda=0.01), _HEADER)
    trainer = Trainer(attributes, (1e-3,) * 6)

    with pytest.raises(EncodeError, match="not finite or exceeds 32767 steps"):
        choose_codes(trainer, context, objective, _generator())


@pytest.mark.parametrize(
    ("quantize_from", "quantize_rd_lambda", "expected"),
    [(0.8, 0.1, [90]), (0.8, 0.0, []), (0.99, 0.1, []), (1.0, 0.1, []), (0.0, 0.1, [50])],
)
def test_codes_are_chosen_once_halfway_through_fine_tuning(
    quantize_from, quantize_rd_lambda, expected
):
    settings = CanonicalSettings(
        iterations=100, quantize_from=quantize_from, quantize_rd_lambda=quantize_rd_lambda
    )
    objective = CanonicalObjective(settings, _HEADER, rd_factor=0.5)

    assert [step for step in range(100) if objective.should_choose_codes(step)] == expected
    assert objective.quantize_rd_lambda == 0.5 * quantize_rd_lambda


def _generator_of(seed):
    return torch.Generator().manual_seed(seed)


def _render(context, attributes):
    gaussians = attributes.activated()
    with torch.no_grad():
        return [context.render(gaussians, view) for view in range(context.view_count)]


def _change_of_pictures(context, attributes, changed, index):
    """Return the squared change of a picture if one Gaussian is replaced by its changed version."""
    is_changed = torch.arange(len(attributes.means)) == index
    pairs = zip(attributes.tensors(), changed.tensors(), strict=True)
    mixed = Attributes(
        *(torch.where(is_changed.view(-1, *[1] * (a.ndim - 1)), b, a) for a, b in pairs)
    )
    before, after = _render(context, attributes), _render(context, mixed)
    squares = [
        float((a.image - b.image).square().mean(dim=2).sum())
        for a, b in zip(before, after, strict=True)
    ]
    return sum(squares) / sum(bool(rendering.radii[index] > 0) for rendering in before)


def _distance(context, first, second):
    pairs = zip(_render(context, first), _render(context, second), strict=True)
    return sum(float((a.image - b.image).square().sum()) for a, b in pairs)


def _train(trainer, context):
    rendering = context.render(trainer.attributes.activated(), 0)
    loss = context.photometric_loss(rendering.image, 0, 0, 0.2)
    trainer.step(loss, rendering.means2d)
