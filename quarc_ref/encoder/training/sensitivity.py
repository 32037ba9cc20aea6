"""Measures how much the pictures of frame 0 depend on the attributes of each Gaussian.

For small changes of one Gaussian, the squared change of a picture is a quadratic form of the
changes. Hutchinson's estimator gives the forms of all Gaussians at once, as in `pruning`: the
matrix of a form is the expected outer product of the derivatives of a sum of all pixels with random
signs.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch

from quarc_ref.encoder.rotations import Float64, conjugate, multiply
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.probes import CHANNEL_COUNT, sum_weighted_by_error, sum_with_signs
from quarc_ref.encoder.training.trainable import Attributes, to_columns
from quarc_ref.format.constants import SH_C0

_PROBE_COUNT = 4


@dataclass(frozen=True, slots=True, eq=False)
class Sensitivities:
    """Squared changes of a picture as quadratic forms, one per Gaussian.

    A squared change is summed over pixels, then averaged over color channels and over the views
    that see the Gaussian.

    Attributes:
        rotations: `[N, 3, 3]` form of x, y and z, if a Gaussian is rotated by the quaternion
            (1, x, y, z) in its own axes.
        colors: `[N, 3, 3]` form of the changes of the three SH DC coefficients.
        median_error: Median of the squared errors around the Gaussians, as in `pruning`.
    """

    rotations: Float64
    colors: Float64
    median_error: float


def measure_sensitivities(
    context: TrainingContext, attributes: Attributes, generator: torch.Generator
) -> Sensitivities:
    """Render all training views; measure the sensitivity of each Gaussian's rotation and SH DC.

    Args:
        context: Training context.
        attributes: Quantized attributes of the Gaussians.
        generator: Random generator of the pixel signs.
    """
    rotation_forms, color_forms = (np.zeros((len(attributes.means), 3, 3)) for _ in range(2))
    errors, view_counts = (torch.zeros_like(attributes.opacities) for _ in range(2))
    unit_quaternions = to_columns(attributes.rotations)
    for view in context.views.used_at(0):
        rotations, sh_dc = (
            tensor.clone().requires_grad_() for tensor in (attributes.rotations, attributes.sh_dc)
        )
        rendered = replace(attributes, rotations=rotations, sh_dc=sh_dc).activated()
        rendering = context.render(rendered, view)
        image = context.apply_mask(rendering.image, view, 0)
        view_counts += rendering.radii > 0
        for _ in range(_PROBE_COUNT):
            by_rotation, by_color = torch.autograd.grad(
                sum_with_signs(image, generator), [rotations, sh_dc], retain_graph=True
            )
            # The derivative by (x, y, z) is the vector part of this product.
            product = multiply(conjugate(unit_quaternions), to_columns(by_rotation))
            rotation_forms += _outer_products(product[1:])
            color_forms += _outer_products(to_columns(by_color))
        (error_by_color,) = torch.autograd.grad(
            sum_weighted_by_error(image, context.truth(view, 0)), sh_dc
        )
        errors += error_by_color.sum(dim=(1, 2)) / SH_C0
    views = view_counts.clamp(min=1)
    scale = 1 / (_PROBE_COUNT * CHANNEL_COUNT * views.double().cpu().numpy()[:, None, None])
    visible_errors = (errors / views)[view_counts > 0]
    median_error = float(visible_errors.median()) if len(visible_errors) else 0.0
    return Sensitivities(rotation_forms * scale, color_forms * scale, median_error)


def _outer_products(columns: Float64) -> Float64:
    """Return the `[N, k, k]` outer product of each column of `[k, N]` with itself."""
    products: Float64 = columns.T[:, :, None] * columns.T[:, None, :]
    return products
