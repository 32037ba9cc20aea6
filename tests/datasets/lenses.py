"""Lenses with distortion, and the formulas of distortion."""

import numpy as np

from quarc_ref.datasets.calibration import Lens

BARREL = Lens(96, 64, 70.0, 72.0, 50.0, 30.0, (-0.2, 0.03, 0.002, -0.001))
PINCUSHION = Lens(96, 64, 70.0, 72.0, 46.0, 33.0, (0.15, 0.02))
RATIONAL = Lens(96, 64, 70.0, 72.0, 48.0, 32.0, (0.1, -0.05, 0.0, 0.0, 0.01, 0.2, 0.02, 0.001))
FISHEYE = Lens(96, 64, 40.0, 41.0, 47.0, 31.0, (0.02, -0.01, 0.001, 0.0), fisheye=True)
EQUIDISTANT = Lens(96, 64, 40.0, 40.0, 48.0, 32.0, fisheye=True)
DISTORTED_LENSES = [BARREL, PINCUSHION, RATIONAL, FISHEYE, EQUIDISTANT]


def distort(lens, x, y):
    """Project a direction (x, y, 1) to a pixel position; centers of pixels are at +0.5."""
    squared_radius = x * x + y * y
    coefficients = [*lens.coefficients, *[0.0] * (8 - len(lens.coefficients))]
    if lens.fisheye:
        radius = np.sqrt(squared_radius)
        angle = np.arctan(radius)
        powers = sum(k * angle ** (2 * i + 2) for i, k in enumerate(coefficients[:4]))
        factor = angle * (1 + powers) / radius
        return lens.fx * factor * x + lens.cx, lens.fy * factor * y + lens.cy
    k1, k2, p1, p2, k3, k4, k5, k6 = coefficients
    factor = 1 + squared_radius * (k1 + squared_radius * (k2 + squared_radius * k3))
    factor = factor / (1 + squared_radius * (k4 + squared_radius * (k5 + squared_radius * k6)))
    distorted_x = x * factor + 2 * p1 * x * y + p2 * (squared_radius + 2 * x * x)
    distorted_y = y * factor + p1 * (squared_radius + 2 * y * y) + 2 * p2 * x * y
    return lens.fx * distorted_x + lens.cx, lens.fy * distorted_y + lens.cy
