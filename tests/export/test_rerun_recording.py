"""Tests recordings of rerun with rerun's own reader."""

from dataclasses import replace

import numpy as np
import pytest

from tests.export.frames import (
    compare_rotations,
    compute_colors,
    compute_opacities,
    export,
    make_clip,
)
from tests.small_streams import CAMERA

_COLOR_STEP = 1 / 255


def test_rerun_reads_every_frame_of_rrd_on_its_timeline(tmp_path):
    chunks = pytest.importorskip("rerun.chunk", reason="install it with pip install '.[rerun]'")
    clip, frames = make_clip()
    path = tmp_path / "frames.rrd"
    path.write_bytes(export("rrd", clip, frames))
    rows = {}
    for chunk in chunks.RrdReader(str(path)).stream():
        if chunk.entity_path == "/world/splats":
            names = ("centers", "colors", "quaternions", "scales", "sh_coefficients")
            columns = ["frame", *(f"GaussianSplats3D:{name}" for name in names)]
            batch = chunk.to_record_batch().select(columns).to_pydict()
            for index, frame in enumerate(batch["frame"]):
                rows[frame] = {name: column[index] for name, column in batch.items()}

    assert sorted(rows) == [0, 1, 2, 3]
    for number, frame in enumerate(frames):
        centers = np.array(rows[number]["GaussianSplats3D:centers"], dtype=np.float32)
        assert np.array_equal(centers, frame.splats.positions)
        packed = np.array(rows[number]["GaussianSplats3D:colors"], dtype=np.uint32)
        red, alpha = packed >> 24, packed & 255
        assert red / 255 == pytest.approx(compute_colors(frame.splats)[:, 0], abs=_COLOR_STEP)
        assert alpha / 255 == pytest.approx(compute_opacities(frame.splats), abs=_COLOR_STEP)
        quaternions = np.roll(rows[number]["GaussianSplats3D:quaternions"], 1, axis=1)
        assert compare_rotations(quaternions, frame.splats.rotations) > 1 - 1e-6
        scales = np.array(rows[number]["GaussianSplats3D:scales"])
        assert scales == pytest.approx(np.exp(frame.splats.log_scales), rel=1e-6)
        sh_rest = np.array(rows[number]["GaussianSplats3D:sh_coefficients"])[:, :3]
        assert sh_rest == pytest.approx(frame.splats.sh[:, 1:], abs=1e-3)


@pytest.mark.parametrize(
    ("up_axis", "right_handed", "expected_axes"),
    [(4, True, [3, 2, 5]), (3, True, [3, 1, 6]), (3, False, [3, 1, 5])],
)
def test_rerun_reads_the_axes_and_the_cameras_of_rrd(
    up_axis, right_handed, expected_axes, tmp_path
):
    chunks = pytest.importorskip("rerun.chunk", reason="install it with pip install '.[rerun]'")
    clip, frames = make_clip(up_axis=up_axis, right_handed=right_handed)
    camera = replace(CAMERA, fx=30.0, cx=20.0, rotation=(0, -1, 0, 1, 0, 0, 0, 0, 1))
    path = tmp_path / "frames.rrd"
    path.write_bytes(export("rrd", replace(clip, cameras=(camera,)), frames[:1]))
    columns = {}
    for chunk in chunks.RrdReader(str(path)).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if name.startswith(("ViewCoordinates:", "Transform3D:", "Pinhole:")):
                columns[name] = np.array(batch.column(name)[0].as_py()[0])

    # Right is 3; up and down are 1 and 2; forward and back are 5 and 6.
    assert columns["ViewCoordinates:xyz"].tolist() == expected_axes
    pose = columns["Transform3D:mat3x3"].reshape(3, 3).T  # stored by column
    position = pose @ [0.5, 0.25, 3.0] + columns["Transform3D:translation"]
    assert position == pytest.approx([0.25, -0.5, 1.0])
    assert columns["Pinhole:resolution"].tolist() == [64, 48]
    matrix = columns["Pinhole:image_from_camera"].reshape(3, 3).T
    assert matrix.tolist() == [[30, 0, 20], [0, 50, 24], [0, 0, 1]]
