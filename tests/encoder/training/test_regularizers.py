import math
from dataclasses import replace

import pytest
import torch

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.regularizers import code_rate_nats, opacity_scale_penalty
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.records import StreamHeader

_HEADER = StreamHeader(rotation_bits=4, sh_rest_step=0.25)
_BLANK = Attributes(
    torch.zeros(2, 3),
    torch.tensor([[2.0, 0, 0, 0], [0, 0, -1.0, 0]]),
    torch.zeros(2, 3),
    torch.zeros(2),
    torch.zeros(2, 1, 3),
    torch.zeros(2, 3, 3),
)


def _measure_code_rate(**changes: torch.Tensor) -> float:
    return float(code_rate_nats(replace(_BLANK, **changes), _HEADER))


def test_the_haze_penalty_is_the_mean_opacity_and_the_mean_scale():
    settings = CanonicalSettings(opacity_reg=2.0, scale_reg=3.0)
    uneven = replace(
        _BLANK,
        opacities=torch.logit(torch.tensor([0.5, 0.9])),
        log_scales=torch.log(torch.tensor([[1.0, 2, 3], [4, 5, 9]])),
    )

    assert float(opacity_scale_penalty(_BLANK, settings)) == pytest.approx(2 * 0.5 + 3 * 1.0)
    assert float(opacity_scale_penalty(uneven, settings)) == pytest.approx(2 * 0.7 + 3 * 4.0)


def test_the_haze_penalty_is_zero_without_a_weight():
    assert opacity_scale_penalty(_BLANK, CanonicalSettings()) == 0


def test_equal_codes_are_free_and_so_is_the_component_that_is_not_coded():
    assert _measure_code_rate() == 0


def test_a_code_of_sh_rest_costs_its_logarithm():
    sh_rest = torch.zeros(2, 3, 3)
    sh_rest[1, 2, 0] = -0.75

    assert _measure_code_rate(sh_rest=sh_rest) == pytest.approx(math.log(1 + 3) / 2)


def test_sh_rest_that_is_not_trained_yet_has_no_rate_and_no_gradient():
    sh_rest, log_scales = torch.ones(2, 3, 3).requires_grad_(), torch.eye(2, 3).requires_grad_()
    attributes = replace(_BLANK, sh_rest=sh_rest, log_scales=log_scales)

    rate = code_rate_nats(attributes, _HEADER, has_sh_rest=False)
    gradient, _ = torch.autograd.grad(rate, [sh_rest, log_scales], allow_unused=True)

    assert rate.item() == pytest.approx(_measure_code_rate(log_scales=log_scales.detach()))
    assert gradient is None


def test_a_rotation_costs_the_logarithm_of_its_smaller_components():
    rotations = torch.tensor([[2.0, 0, 0, 0], [0.6, 0, 0, -0.8]])

    assert _measure_code_rate(rotations=rotations) == pytest.approx(math.log(1 + 0.6 * 16) / 2)


def test_scales_and_colors_cost_the_logarithm_of_their_spread_in_every_row():
    log_scales = torch.tensor([[1.0, 0, 0], [2.0, 0, 0]])
    colors = torch.tensor([[0.0, 0, 3.0], [0, 0, -1.0]])[:, None]

    spread = math.log(1 + 0.5 * 16) + math.log(1 + 2.0 * 32)
    assert _measure_code_rate(log_scales=log_scales, sh_dc=colors) == pytest.approx(spread)


def test_the_gradient_reduces_rotations():
    rotations = torch.tensor([[1.0, 0.2, -0.1, 0]]).requires_grad_()
    attributes = replace(_BLANK.rows(torch.tensor([0])), rotations=rotations)

    loss = code_rate_nats(attributes, _HEADER)
    (gradient,) = torch.autograd.grad(loss, rotations)

    assert gradient[0, 1] > 0 > gradient[0, 2]
