"""Which Gaussians of a canonical frame the pictures would miss.

A picture is linear in the opacity of one Gaussian, the others as they are: its
derivative by that opacity, times the opacity, is all that would change if the
Gaussian were gone. The sum of the squares of that over a picture is found
without a pass per Gaussian: the derivative of a sum of pixels with random
signs, squared, is that sum on average (Hutchinson's estimate of a diagonal).

The square alone decides and not the rise of the error: what the others do not
take over in fine-tuning is the size of the hole.
"""

import torch
from torch import Tensor

from quarc_ref.encoder.studio import Studio
from quarc_ref.encoder.trainable import Attributes, Trainer
from quarc_ref.rendering.rasterizer import Gaussians

_PROBES = 2


def prune_unmissed(
    trainer: Trainer, studio: Studio, price: float, generator: torch.Generator
) -> None:
    """Drop the Gaussians that frame 0 would not miss.

    Args:
        trainer: Changed in place.
        studio: Its training views are the pictures.
        price: Change of the pictures, mean square, below which a Gaussian goes;
            1 is the mean squared error of the pictures over the number of Gaussians.
        generator: Of the probes.
    """
    presence, error = measure_presence(studio, trainer.attributes.detached(), generator)
    kept = presence * trainer.count >= price * error
    kept[presence.argmax()] = True
    nothing = kept.new_zeros(0, dtype=torch.long)
    trainer.replace_rows(kept, trainer.attributes.detached().rows(nothing))


def measure_presence(
    studio: Studio, attributes: Attributes, generator: torch.Generator
) -> tuple[Tensor, float]:
    """Return what each Gaussian of frame 0 does to its pictures, and what these miss.

    Args:
        studio: Its training views are the pictures.
        attributes: Of the Gaussians.
        generator: Of the probes.

    Returns:
        `[N]` mean squared change of the pictures if the Gaussian alone were
        gone (an estimate without bias), and the pictures' mean squared error.
    """
    drawn = attributes.activated()
    presence, error = torch.zeros_like(drawn.opacities), 0.0
    views = len(studio.views.cameras)
    for view in range(views):
        gates = torch.ones_like(presence).requires_grad_()
        image = studio.render(_gated(drawn, gates), view).image
        error += float((image.detach() - studio.truth(view, 0)).square().mean()) / views
        for _ in range(_PROBES):
            signs = torch.randint(0, 2, image.shape, generator=generator) * 2 - 1
            total = (image * signs.to(image)).sum()
            (change,) = torch.autograd.grad(total, gates, retain_graph=True)
            presence += change.square() / (_PROBES * views * image.numel())
    return presence, error


def _gated(drawn: Gaussians, gates: Tensor) -> Gaussians:
    """Return Gaussians whose opacities are multiplied by `[N]` gates."""
    return Gaussians(
        drawn.means, drawn.quaternions, drawn.scales, drawn.opacities * gates, drawn.sh
    )
