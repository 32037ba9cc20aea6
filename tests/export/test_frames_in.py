"""Tests that imported frames equal the exported frames."""

import gzip
import os
import struct
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.camera_geometry import rotation_matrix
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.conversion import convert_in_subprocess
from quarc_ref.export.errors import NoFramesError, UnreadableFramesError
from quarc_ref.export.frames_in import open_frames
from quarc_ref.export.sidecar import (
    SIDECAR_NAME,
    build_sidecar,
)
from quarc_ref.export.spz import check_header
from quarc_ref.export.table import EXPORT_FORMATS
from quarc_ref.export.upright import rotate_upright
from quarc_ref.format.records import StreamHeader
from tests.small_streams import CAMERA, make_stream

_HEADER = StreamHeader(
    seed=7,
    gaussians_per_anchor=4,
    sh_rest_step=1 / 128,
    timescale=25,
    up_axis=5,
    meters_per_unit=0.5,
)


@pytest.fixture(scope="module")
def clip_and_frames():
    _, states = make_stream(_HEADER)
    return Clip(_HEADER, (CAMERA,), {"title": "small"}), [
        Frame.from_scene(state.scene) for state in states
    ]


def write_folder(folder, clip, frames, suffix):
    export = EXPORT_FORMATS[suffix]
    if export.package:
        pytest.importorskip(export.package)
    folder.mkdir()
    for number, frame in enumerate(frames):
        (folder / f"f{number}.{suffix}").write_bytes(export.load_builder()(frame, clip))


def test_a_folder_of_ply_is_read_in_numeric_order(clip_and_frames, tmp_path):
    clip, frames = clip_and_frames
    write_folder(tmp_path / "in", clip, [frames[number % 4] for number in range(12)], "ply")
    imported = open_frames(tmp_path / "in")
    imported_splats = [splats for splats, ids in imported.read()]

    assert imported.count == 12
    assert imported.frames_per_second is None
    assert (imported.sidecar.up_axis, imported.sidecar.meters_per_unit) == (0, 0)  # unknown
    for number, splats in enumerate(imported_splats):
        assert np.array_equal(splats.positions, frames[number % 4].splats.positions)
        assert np.array_equal(splats.sh, frames[number % 4].splats.sh)


def test_hidden_files_are_no_frames(clip_and_frames, tmp_path):
    clip, frames = clip_and_frames
    write_folder(tmp_path / "in", clip, frames, "ply")
    for name in ("._f0.ply", "._f0.spz"):  # macOS writes such files to other file systems
        (tmp_path / "in" / name).write_bytes(b"attributes")
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "._a.4dgs").write_bytes(b"attributes")

    assert len(list(open_frames(tmp_path / "in").read())) == 4
    with pytest.raises(NoFramesError, match=r"no \.ply or \.spz"):
        open_frames(tmp_path / "empty")


@pytest.mark.skipif(os.name == "nt", reason="no named pipes")
def test_a_named_pipe_is_no_frame(clip_and_frames, tmp_path):
    clip, frames = clip_and_frames
    write_folder(tmp_path / "in", clip, frames, "ply")
    os.mkfifo(tmp_path / "in" / "f4.ply")

    assert len(list(open_frames(tmp_path / "in").read())) == 4


def test_a_sidecar_gives_rate_axes_and_cameras(clip_and_frames, tmp_path):
    clip, frames = clip_and_frames
    write_folder(tmp_path / "in", clip, frames, "ply")
    (tmp_path / "in" / SIDECAR_NAME).write_bytes(build_sidecar(clip, "f{frame}.ply", 0))
    imported = open_frames(tmp_path / "in")

    assert imported.frames_per_second == 25
    assert (imported.sidecar.up_axis, imported.sidecar.meters_per_unit) == (5, 0.5)
    assert imported.sidecar.cameras == (CAMERA,)
    assert imported.sidecar.metadata == {"title": "small"}


def test_spz_is_read_with_its_axes(clip_and_frames, tmp_path):
    clip, frames = clip_and_frames
    write_folder(tmp_path / "in", clip, frames, "spz")
    imported = open_frames(tmp_path / "in")
    splats, ids = next(iter(imported.read()))

    assert ids is None
    assert imported.sidecar.up_axis == 3
    x, y, z = frames[0].splats.positions.T  # +z is up in the stream
    assert splats.positions == pytest.approx(np.stack([x, z, -y], axis=1), abs=2**-12)


@pytest.mark.parametrize("right_handed", [True, False])
@pytest.mark.parametrize("up_axis", [0, 1, 6])
def test_cameras_see_imported_spz_frames_as_they_saw_the_stream(
    up_axis, right_handed, clip_and_frames, tmp_path
):
    clip, frames = clip_and_frames
    header = replace(_HEADER, up_axis=up_axis, right_handed=right_handed)
    clip = Clip(header, (CAMERA,))
    write_folder(tmp_path / "in", clip, frames[:1], "spz")
    (tmp_path / "in" / SIDECAR_NAME).write_bytes(build_sidecar(clip, "f{frame}.spz", 0))
    imported = open_frames(tmp_path / "in")
    (camera,), (splats, _) = imported.sidecar.cameras, next(iter(imported.read()))

    def list_camera_coordinates(splats, camera):
        return splats.positions @ rotation_matrix(camera).T + np.array(camera.translation)

    assert (imported.sidecar.up_axis, imported.sidecar.right_handed) == (3, True)
    assert list_camera_coordinates(splats, camera) == pytest.approx(
        list_camera_coordinates(frames[0].splats, CAMERA), abs=2**-11
    )


def test_spz_is_read_by_a_package_outside_the_environment(tmp_path, monkeypatch):
    package = "class GaussForge:\n    def convert(self, data, *_):\n        return {'data': data}\n"
    (tmp_path / "packages").mkdir()
    (tmp_path / "packages" / "gaussforge.py").write_text(package)
    (tmp_path / "gaussforge.py").write_text("raise SystemExit('from the current folder')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path / "packages")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "packages"))

    assert convert_in_subprocess(b"spz", "spz", "ply") == b"spz"


@pytest.mark.parametrize("share", [0.5, 0.99])
def test_a_truncated_spz_is_reported_as_such(share, clip_and_frames, tmp_path):
    clip, frames = clip_and_frames
    write_folder(tmp_path / "in", clip, frames[:1], "spz")
    path = tmp_path / "in" / "f0.spz"
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])

    with pytest.raises(UnreadableFramesError, match=r"f0\.spz: gaussforge cannot read the file: "):
        list(open_frames(tmp_path / "in").read())


@given(extra=st.integers((1 << 20) + 92, 1 << 22), junk=st.binary(max_size=32))
def test_a_spz_that_decompresses_to_more_than_its_gaussians_is_rejected(extra, junk):
    header = b"NGSP" + struct.pack("<II4B", 3, 1, 0, 12, 0, 0)
    check_header(gzip.compress(header + bytes(20)) + junk)

    with pytest.raises(ValueError, match="more than 1048668 bytes"):
        check_header(gzip.compress(header + bytes(extra)) + junk)


def test_spz_opacities_of_one_have_a_finite_logit(clip_and_frames, tmp_path):
    clip, frames = clip_and_frames
    opacities = frames[0].splats.opacities.copy()
    opacities[0] = 40.0
    pytest.importorskip("gaussforge")
    frame = Frame(frames[0].scene, replace(frames[0].splats, opacities=opacities))
    path = tmp_path / "one.spz"
    path.write_bytes(EXPORT_FORMATS["spz"].load_builder()(frame, clip))
    splats, _ = next(iter(open_frames(path).read()))

    assert np.isfinite(splats.opacities).all()
    assert splats.opacities[0] > 5


def test_4dgs_has_ids_and_its_own_frame_rate(clip_and_frames, tmp_path):
    pytest.importorskip("fourdgs")
    clip, frames = clip_and_frames
    sequence = EXPORT_FORMATS["4dgs"].begin(clip)
    for frame in frames:
        sequence.add(frame)
    path = tmp_path / "all.4dgs"
    path.write_bytes(sequence.finish())
    imported = open_frames(path)

    assert (imported.count, imported.frames_per_second) == (4, pytest.approx(25))
    for (splats, ids), frame in zip(imported.read(), frames, strict=True):
        assert np.array_equal(ids, frame.scene.ids)
        assert np.isfinite(splats.opacities).all()
        bound = 0.04 * float(np.median(np.exp(frame.splats.log_scales)))
        assert splats.positions == pytest.approx(frame.splats.positions, abs=bound)
        assert splats.log_scales == pytest.approx(frame.splats.log_scales, abs=0.01)
        assert np.abs((splats.rotations * frame.splats.rotations).sum(axis=1)).min() > 1 - 1e-5


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({}, "no .ply or .spz"),
        ({"a.ply": b"", "b.spz": b""}, "both .ply and .spz"),
        ({"a.ply": b"ply\n"}, "a.ply"),
        ({"a.spz": b"\x1f\x8b not gzip"}, "a.spz"),
        ({"a.spz": b"NGSP" + bytes([3, 0, 0, 0]) + b"\xff" * 8}, "too short for the"),
        ({"a.ply": b"ply\n", SIDECAR_NAME: b"{"}, SIDECAR_NAME),
    ],
)
def test_unreadable_inputs_are_named(files, message, tmp_path):
    for name, data in files.items():
        (tmp_path / name).write_bytes(data)

    with pytest.raises(UnreadableFramesError, match=message):
        list(open_frames(tmp_path).read())


@pytest.mark.parametrize("data", [b"", b"4dgs", bytes(200)])
def test_an_invalid_4dgs_is_named(data, tmp_path):
    pytest.importorskip("fourdgs")
    (tmp_path / "a.4dgs").write_bytes(data)

    with pytest.raises(UnreadableFramesError, match=r"a[.]4dgs"):
        open_frames(tmp_path / "a.4dgs")


def test_a_4dgs_with_an_impossible_frame_rate_is_rejected(clip_and_frames, tmp_path):
    pytest.importorskip("fourdgs")
    clip, frames = clip_and_frames
    sequence = EXPORT_FORMATS["4dgs"].begin(Clip(replace(clip.header, timescale=1 << 31)))
    for frame in frames:
        sequence.add(frame)
    (tmp_path / "all.4dgs").write_bytes(sequence.finish())

    with pytest.raises(UnreadableFramesError, match="frames per second"):
        open_frames(tmp_path / "all.4dgs")


@pytest.mark.parametrize(
    ("named_file", "rate", "count"), [("all.4dgs", 50, 8), ("other.4dgs", 25, 4)]
)
def test_a_4dgs_has_the_frame_rate_of_a_sidecar_that_names_it(
    named_file, rate, count, clip_and_frames, tmp_path
):
    pytest.importorskip("fourdgs")
    clip, frames = clip_and_frames
    sequence = EXPORT_FORMATS["4dgs"].begin(clip)
    for frame in frames:
        sequence.add(frame)
    (tmp_path / "all.4dgs").write_bytes(sequence.finish())
    sidecar_clip = Clip(replace(clip.header, timescale=50))
    (tmp_path / SIDECAR_NAME).write_bytes(build_sidecar(sidecar_clip, named_file, 0))
    imported = open_frames(tmp_path / "all.4dgs")

    assert (imported.frames_per_second, imported.count) == (pytest.approx(rate), count)


def test_a_4dgs_of_another_program_has_view_dependent_color(clip_and_frames, tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    pytest.importorskip("pygltflib")
    clip, (frame, *_) = clip_and_frames
    positions = np.random.default_rng(0).uniform(-1, 1, frame.splats.positions.shape)
    splats = replace(frame.splats, positions=positions.astype(np.float32))
    data = EXPORT_FORMATS["glb"].load_builder()(Frame(frame.scene, splats), clip)
    (tmp_path / "a.glb").write_bytes(data)
    gaussians = fourdgs.from_gltf(str(tmp_path / "a.glb")).gaussians
    options = fourdgs.WriteOptions(profile="fine")
    fourdgs.write(str(tmp_path / "a.4dgs"), gaussians, 1.0, options=options)
    imported, _ = next(iter(open_frames(tmp_path / "a.4dgs").read()))

    splats = rotate_upright(splats, clip)
    offsets = imported.positions / clip.meters_per_unit - splats.positions[:, None]
    order = np.linalg.norm(offsets, axis=2).argmin(axis=1)
    assert imported.sh[order, 1:] == pytest.approx(splats.sh[:, 1:], abs=0.03)


def test_a_4dgs_with_linear_motion_is_sampled(tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    rng = np.random.default_rng(0)
    positions = rng.uniform(-1, 1, (20, 3)).astype(np.float32)
    start_times = np.where(np.arange(20) < 15, 0.0, 0.5)
    gaussians = fourdgs.GaussianSet(
        positions=positions,
        scales=np.full((20, 3), 0.05, np.float32),
        rotations=np.tile(np.float32([0, 0, 0, 1]), (20, 1)),
        colors=rng.uniform(0.1, 0.9, (20, 4)).astype(np.float32),
        motions=np.tile(np.float32([0.2, 0, 0]), (20, 1)),
        mu_t=np.zeros(20, np.float32),
        sigma_t=np.full(20, np.inf, np.float32),
        win_lo=start_times,
        win_hi=np.full(20, 1.0),
    )
    path = tmp_path / "lines.4dgs"
    fourdgs.write(str(path), gaussians, 1.0, options=fourdgs.WriteOptions(profile="fine"))
    imported = open_frames(path, 10)
    frames = list(imported.read())

    assert (imported.count, imported.frames_per_second) == (10, 10)
    assert [len(ids) for _, ids in frames] == [15] * 5 + [20] * 5
    middle = positions[:15].mean(axis=0) + np.array([0.2 * 0.05, 0, 0])
    assert frames[0][0].positions.mean(axis=0) == pytest.approx(middle, abs=0.002)
    common_rows = np.intersect1d(frames[0][1], frames[4][1], return_indices=True)[1:]
    displacements = frames[4][0].positions[common_rows[1]] - frames[0][0].positions[common_rows[0]]
    assert displacements == pytest.approx(np.tile([0.08, 0, 0], (15, 1)), abs=0.01)
