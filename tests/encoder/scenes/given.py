"""Random Gaussians in floats, and functions that move, select and concatenate them."""

from dataclasses import replace

import numpy as np

from quarc_ref.decoder import Splats


def make_splats(count=200, coefficients=4, seed=0):
    """Return random Gaussians in a box of one unit, with values that are not on a grid."""
    rng = np.random.default_rng(seed)
    rotations = rng.normal(size=(count, 4))
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    return Splats(
        rng.uniform(-0.5, 0.5, (count, 3)).astype(np.float32),
        rotations.astype(np.float32),
        rng.uniform(-4.5, -2.5, (count, 3)).astype(np.float32),
        rng.uniform(-3, 5, count).astype(np.float32),
        rng.uniform(-0.9, 0.9, (count, coefficients, 3)).astype(np.float32),
    )


def move(splats, shift, angle=0.0, fraction=0.5, seed=1):
    """Return the Gaussians after shifting a fraction of them and rotating it around z, radians."""
    rng = np.random.default_rng(seed)
    is_moved = rng.random(len(splats.positions)) < fraction
    positions, rotations = splats.positions.copy(), splats.rotations.copy()
    positions[is_moved] += np.asarray(shift, np.float32)
    c, s = np.cos(angle / 2), np.sin(angle / 2)
    w, x, y, z = splats.rotations[is_moved].T
    rotations[is_moved] = np.stack([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], 1)
    return replace(splats, positions=positions, rotations=rotations)


def select_rows(splats, rows):
    """Return the Gaussians of some rows."""
    names = ("positions", "rotations", "log_scales", "opacities", "sh")
    return Splats(*(getattr(splats, name)[rows] for name in names))


def concatenate(*parts):
    """Return the Gaussians of several scenes in one scene."""
    names = ("positions", "rotations", "log_scales", "opacities", "sh")
    return Splats(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))
