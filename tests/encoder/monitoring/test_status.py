import pytest
import torch

from quarc_ref.encoder.monitoring.monitor import TrainingStep
from quarc_ref.encoder.monitoring.status import EncodeStatus

_GRAY = torch.full((4, 6, 3), 0.5)


def _make_step(error, mask=None):
    image = _GRAY + error
    return TrainingStep("motion", 1, 1, 9, 1200, torch.tensor(0.1), image, lambda: _GRAY, mask)


@pytest.mark.parametrize("mask", [None, torch.zeros(4, 6, 1)])
def test_a_view_without_error_or_pixels_is_not_part_of_the_mean_psnr(mask):
    times = iter([0.0, 1.0, 2.0])
    status = EncodeStatus(clock=lambda: next(times))

    status.step(_make_step(0.0, mask))
    assert status.describe() == "1,200 Gaussians"
    status.step(_make_step(0.1))
    status.step(_make_step(0.01))

    assert status.describe() == "30.0 dB train, 1,200 Gaussians"
