"""Tests that rotated frames are upright and look like the original frames."""

from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.export.clip import Clip
from quarc_ref.export.upright import rotate_upright
from quarc_ref.format.records import AXES, StreamHeader
from tests.export.frames import make_frame

_UP_VECTORS = dict(zip(AXES, np.concatenate([[v, -v] for v in np.eye(3)]), strict=True))


def build_matrices(rotations):
    w, x, y, z = (rotations / np.linalg.norm(rotations, axis=1, keepdims=True)).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def build_covariances(splats):
    axes = build_matrices(splats.rotations)
    return np.einsum("nij,nj,nkj->nik", axes, np.exp(2 * splats.log_scales), axes)


def evaluate_colors(splats, directions):
    x, y, z = directions.T
    basis = 0.4886025119029199 * np.stack([-y, z, -x])
    return 0.28209479177387814 * splats.sh[:, 0] + np.einsum("kn,nkc->nc", basis, splats.sh[:, 1:])


@pytest.mark.parametrize("right_handed", [True, False])
@pytest.mark.parametrize("up", range(7))
def test_rotations_positions_and_colors_rotate_together(up, right_handed):
    _, splats = make_frame(1)
    splats = replace(splats, log_scales=splats.log_scales / 4)
    clip = Clip(StreamHeader(up_axis=up, right_handed=right_handed))
    rotated = rotate_upright(splats, clip)

    # The rotation follows from the original and the rotated positions.
    matrix = np.linalg.lstsq(splats.positions, rotated.positions, rcond=None)[0].T
    assert np.round(matrix) == pytest.approx(matrix, abs=1e-4)
    matrix = np.round(matrix)
    assert np.linalg.det(matrix) == pytest.approx(1 if right_handed else -1)
    assert matrix @ _UP_VECTORS[clip.up] == pytest.approx([0, 1, 0])
    assert build_covariances(rotated) == pytest.approx(
        matrix @ build_covariances(splats) @ matrix.T, rel=1e-3, abs=1e-4
    )
    rng = np.random.default_rng(0)
    directions = rng.normal(size=splats.positions.shape)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    assert evaluate_colors(rotated, directions @ matrix.T) == pytest.approx(
        evaluate_colors(splats, directions), abs=1e-5
    )


def test_an_unknown_up_axis_is_treated_as_in_ply():
    assert Clip(StreamHeader(up_axis=0)).up == "-y"
