import pytest
import torch

from quarc_ref.encoder.training.adam import ADAM_EPSILON
from quarc_ref.encoder.training.trainable import Trainer, from_splats
from tests.encoder.toys import make_splats

_RATES = (1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3)


def _compute_loss(attributes, targets):
    """Return a loss that depends on the same tensors as a rendering."""
    tensors = attributes.activated().tensors()
    return sum(
        (tensor - target).square().sum() for tensor, target in zip(tensors, targets, strict=True)
    )


def test_steps_equal_those_of_unfused_adam():
    attributes = from_splats(make_splats(0), torch.device("cpu"))
    generator = torch.Generator().manual_seed(0)
    targets = [
        torch.randn(tensor.shape, generator=generator)
        for tensor in attributes.activated().tensors()
    ]
    trainer, reference = Trainer(attributes, _RATES), Trainer(attributes, _RATES).attributes
    groups = [
        {"params": [leaf], "lr": lr} for leaf, lr in zip(reference.tensors(), _RATES, strict=True)
    ]
    adam = torch.optim.Adam(groups, eps=ADAM_EPSILON, foreach=False)

    for _ in range(3):
        trainer.step(_compute_loss(trainer.attributes, targets), trainer.attributes.means)
        adam.zero_grad()
        _compute_loss(reference, targets).backward()
        adam.step()

    for trained, expected in zip(trainer.attributes.tensors(), reference.tensors(), strict=True):
        assert trained.detach().numpy() == pytest.approx(expected.detach().numpy(), abs=1e-6)
