"""Tests every export format with an independent reader."""

import io
import shutil
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.export.clip import Frame
from quarc_ref.export.errors import ExportError
from quarc_ref.export.fourdgs_file import read_4dgs
from quarc_ref.export.upright import rotate_upright
from tests.export.frames import (
    compare_rotations,
    compute_colors,
    compute_opacities,
    export,
    make_clip,
)
from tests.small_streams import CAMERA

_FPS = 30
_SPZ_STEP = 2**-12
_COLOR_STEP = 1 / 255


def read_by_gaussforge(data, source_format):
    """Read a file with gaussforge by conversion to PLY; return arrays `[N, ...]`.

    The array `sh` is missing for scenes without view-dependent color.
    """
    package = pytest.importorskip("gaussforge")
    result = package.GaussForge().convert(data, source_format, "ply")
    assert "error" not in result, result
    header, _, body = result["data"].partition(b"end_header\n")
    names = [line.split()[2].decode() for line in header.splitlines() if b"property float" in line]
    table = dict(zip(names, np.frombuffer(body, "<f4").reshape(-1, len(names)).T, strict=True))

    def stack(stem, count):
        return np.stack([table[f"{stem}{number}"] for number in range(count)], axis=1)

    rest_count = sum(name.startswith("f_rest") for name in names) // 3
    arrays = {
        "positions": np.stack([table[name] for name in "xyz"], axis=1),
        "scales": stack("scale_", 3),
        "rotations": stack("rot_", 4),
        "alphas": table["opacity"],
        "colors": stack("f_dc_", 3),
    }
    if rest_count:
        arrays["sh"] = (
            stack("f_rest_", 3 * rest_count).reshape(-1, 3, rest_count).transpose(0, 2, 1)
        )
    return arrays


def get_sh_dc(splats):
    return splats.sh[:, 0]


def match_nearest(positions, expected):
    """Return the index of the nearest imported Gaussian for each expected Gaussian."""
    distances = np.linalg.norm(positions[None] - expected[:, None], axis=2)
    order = distances.argmin(axis=1)
    assert distances.min(axis=1).max() < 2e-3
    return order


def test_gaussforge_reads_all_values_of_ply():
    clip, frames = make_clip()
    imported = read_by_gaussforge(export("ply", clip, frames), "ply")
    splats = frames[-1].splats

    assert np.array_equal(imported["positions"], splats.positions)
    assert np.allclose(imported["rotations"], splats.rotations, atol=1e-6)
    assert np.array_equal(imported["scales"], splats.log_scales)
    assert np.array_equal(imported["alphas"], splats.opacities)
    assert np.array_equal(imported["colors"], get_sh_dc(splats))
    assert np.array_equal(imported["sh"], splats.sh[:, 1:])


@pytest.mark.parametrize("degree", [0, 1])
def test_spz_has_the_upright_scene_within_its_steps(degree):
    clip, frames = make_clip(sh_degree=degree, up_axis=4)
    imported = read_by_gaussforge(export("spz", clip, frames), "spz")
    splats = frames[-1].splats

    position_signs = np.array([1, -1, -1])  # -y is up in the stream, +y in SPZ
    assert imported["positions"] == pytest.approx(splats.positions * position_signs, abs=_SPZ_STEP)
    w, x, y, z = splats.rotations.T
    expected_rotations = np.stack([-x, w, -z, y], axis=1)
    assert compare_rotations(imported["rotations"], expected_rotations) > 0.999
    assert imported["scales"] == pytest.approx(splats.log_scales, abs=1 / 16)
    opacity = 1 / (1 + np.exp(-imported["alphas"]))
    assert opacity == pytest.approx(compute_opacities(splats), abs=_COLOR_STEP)
    assert imported["colors"] == pytest.approx(get_sh_dc(splats), abs=_COLOR_STEP / 0.15)
    if degree:
        sh_signs = np.array([-1, -1, 1])[:, None]  # of y, z and x
        assert imported["sh"] == pytest.approx(splats.sh[:, 1:] * sh_signs, abs=1 / 16)


def test_spz_rejects_positions_out_of_its_range():
    clip, frames = make_clip()
    distant = replace(frames[-1].splats, positions=frames[-1].splats.positions + 3000)

    with pytest.raises(ExportError, match="SPZ"):
        export("spz", clip, [Frame(frames[-1].scene, distant)])


@pytest.mark.parametrize("degree", [0, 1])
def test_sog_has_the_scene_in_the_axes_of_the_stream(degree):
    clip, frames = make_clip(sh_degree=degree)
    imported = read_by_gaussforge(export("sog", clip, frames), "sog")
    splats = frames[-1].splats

    assert len(imported["positions"]) == frames[-1].scene.count
    first_rows = np.unique(splats.positions, axis=0, return_index=True)[
        1
    ]  # some have the same position
    counts = (splats.positions[first_rows][:, None] == splats.positions[None]).all(2).sum(1)
    unique_rows = first_rows[counts == 1]
    order = match_nearest(imported["positions"], splats.positions[unique_rows])
    assert compare_rotations(imported["rotations"][order], splats.rotations[unique_rows]) > 0.999
    assert imported["scales"][order] == pytest.approx(splats.log_scales[unique_rows], abs=0.1)
    assert imported["colors"][order] == pytest.approx(get_sh_dc(splats)[unique_rows], abs=0.1)


@pytest.mark.parametrize("name", ["spz", "sog"])
def test_splat_transform_reads_files_of_gaussforge(name, tmp_path):
    program = shutil.which("splat-transform")
    if program is None:
        pytest.skip("install it with npm install -g @playcanvas/splat-transform")
    clip, frames = make_clip(up_axis=4)
    (tmp_path / f"frame.{name}").write_bytes(export(name, clip, frames))
    converted = tmp_path / "back.ply"
    subprocess.run([program, "-q", "-g", "cpu", tmp_path / f"frame.{name}", converted], check=True)
    imported = read_by_gaussforge(converted.read_bytes(), "ply")
    splats = frames[-1].splats

    assert len(imported["positions"]) == frames[-1].scene.count
    low, high = splats.positions.min(axis=0), splats.positions.max(axis=0)
    assert imported["positions"].min(axis=0) == pytest.approx(low, abs=2e-3)
    assert imported["positions"].max(axis=0) == pytest.approx(high, abs=2e-3)


@pytest.mark.parametrize("up", [3, 4, 5])
def test_fourdgs_reads_glb_upright_and_in_meters(up, tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    clip, frames = make_clip(up_axis=up, meters_per_unit=0.5)
    path = tmp_path / "frame.glb"
    path.write_bytes(export("glb", clip, frames))
    imported, splats = fourdgs.from_gltf(str(path)).gaussians, frames[-1].splats

    x, y, z = splats.positions.T
    expected = {3: [x, y, z], 4: [x, -y, -z], 5: [x, z, -y]}[up]
    assert np.array_equal(imported.positions, np.stack(expected, axis=1) * 0.5)
    assert imported.scales == pytest.approx(np.exp(splats.log_scales) * 0.5, rel=1e-6)
    assert imported.colors[:, :3] == pytest.approx(compute_colors(splats), abs=1e-6)
    assert imported.colors[:, 3] == pytest.approx(compute_opacities(splats), abs=1e-6)
    rotations = rotate_upright(splats, clip).rotations
    assert compare_rotations(np.roll(imported.rotations, 1, axis=1), rotations) > 1 - 1e-6


def test_glb_has_the_properties_required_by_the_extension():
    gltf = pytest.importorskip("pygltflib")
    clip, frames = make_clip()
    model = gltf.GLTF2().load_from_bytes(export("glb", clip, frames))
    primitive = model.meshes[0].primitives[0]

    assert model.extensionsUsed == ["KHR_gaussian_splatting"]
    assert primitive.mode == gltf.POINTS
    assert primitive.extensions["KHR_gaussian_splatting"]["kernel"] == "ellipse"
    assert {accessor.count for accessor in model.accessors} == {frames[-1].scene.count}
    upright = rotate_upright(frames[-1].splats, clip)
    bounds = model.accessors[primitive.attributes.POSITION]
    assert bounds.min == upright.positions.min(axis=0).tolist()
    assert bounds.max == upright.positions.max(axis=0).tolist()
    for degree, coefficient, column in ((0, 0, 0), (1, 0, 1), (1, 1, 2), (1, 2, 3)):
        name = f"KHR_gaussian_splatting:SH_DEGREE_{degree}_COEF_{coefficient}"
        view = model.bufferViews[getattr(primitive.attributes, name)]
        sh = np.frombuffer(model.binary_blob(), "<f4", view.byteLength // 4, view.byteOffset)
        assert np.array_equal(sh.reshape(-1, 3), upright.sh[:, column])


def test_openusd_reads_a_time_sample_per_frame(tmp_path):
    usd = pytest.importorskip("pxr.Usd")
    from pxr import UsdGeom, UsdVol

    clip, frames = make_clip(up_axis=3, meters_per_unit=0.5)
    path = tmp_path / "frames.usdc"
    path.write_bytes(export("usdc", clip, frames))
    stage = usd.Stage.Open(str(path))
    field = UsdVol.ParticleField3DGaussianSplat(stage.GetPrimAtPath("/scene/splats"))

    assert stage.GetTimeCodesPerSecond() == _FPS
    assert UsdGeom.GetStageMetersPerUnit(stage) == 0.5
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (0, len(frames) - 1)
    assert field.GetPositionsAttr().GetTimeSamples() == [0, 1, 2, 3]
    for time, frame in enumerate(frames):
        splats = frame.splats
        assert np.array_equal(np.array(field.GetPositionsAttr().Get(time)), splats.positions)
        opacities = np.array(field.GetOpacitiesAttr().Get(time))
        assert opacities == pytest.approx(compute_opacities(splats), abs=1e-6)
        sh = np.array(field.GetRadianceSphericalHarmonicsCoefficientsAttr().Get(time))
        assert np.array_equal(sh.reshape(splats.sh.shape), splats.sh)
        radii = 3 * np.exp(splats.log_scales).max(axis=1, keepdims=True)
        low, high = np.array(field.GetExtentAttr().Get(time))
        assert low == pytest.approx((splats.positions - radii).min(axis=0))
        assert high == pytest.approx((splats.positions + radii).max(axis=0))
    camera = UsdGeom.Camera(stage.GetPrimAtPath("/scene/camera_00"))
    pose = np.array(camera.GetLocalTransformation()).T
    assert pose[:3, 3] == pytest.approx([0, 0, -2])  # the position of CAMERA
    assert pose[:3, :3] @ [0, 0, -1] == pytest.approx([0, 0, 1])  # the viewing direction


def test_openusd_reports_a_full_disk_in_one_line():
    pytest.importorskip("pxr.Usd")
    pytest.importorskip("resource")
    program = """
import resource, signal
from tests.export.frames import export, make_clip
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
export("usdc", *make_clip())
"""
    command = [sys.executable, "-c", program]
    completed = subprocess.run(command, capture_output=True, text=True, check=False)

    last_line = completed.stderr.splitlines()[-1]
    assert "ExportError: OpenUSD cannot write" in last_line
    assert last_line.endswith("File too large")


def test_usd_cameras_see_points_at_the_same_pixels(tmp_path):
    usd = pytest.importorskip("pxr.Usd")
    from pxr import UsdGeom

    clip, frames = make_clip(up_axis=3)
    camera = replace(CAMERA, fx=30.0, fy=50.0, cx=20.0, cy=13.0)
    path = tmp_path / "frames.usdc"
    path.write_bytes(export("usdc", replace(clip, cameras=(camera,)), frames[:1]))
    stage = usd.Stage.Open(str(path))
    frustum = UsdGeom.Camera(stage.GetPrimAtPath("/scene/camera_00")).GetCamera(0).frustum
    assert frustum.nearFar.min == pytest.approx(0.2 * camera.near)  # SPEC 10.3
    x, y, z = 0.3, 0.2, 2.0  # in the axes of the camera: right, down, forward
    projected = frustum.ComputeProjectionMatrix().Transform((x, -y, -z))

    assert (1 + projected[0]) / 2 * camera.width == pytest.approx(camera.fx * x / z + camera.cx)
    assert (1 - projected[1]) / 2 * camera.height == pytest.approx(camera.fy * y / z + camera.cy)


def test_usd_shows_the_first_frame_to_readers_without_time(tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    clip, frames = make_clip(up_axis=3)
    path = tmp_path / "frames.usdc"
    path.write_bytes(export("usdc", clip, frames))
    imported, splats = fourdgs.from_usd(str(path)).gaussians, frames[0].splats

    assert np.array_equal(imported.positions, splats.positions)
    assert compare_rotations(np.roll(imported.rotations, 1, axis=1), splats.rotations) > 1 - 1e-6
    assert imported.scales == pytest.approx(np.exp(splats.log_scales), rel=1e-6)
    assert imported.colors[:, :3] == pytest.approx(compute_colors(splats), abs=1e-6)


def test_fourdgs_reads_every_frame_of_4dgs_at_its_time():
    keyframe_delta_file = pytest.importorskip("fourdgs.keyframe_delta_file")
    clip, frames = make_clip()
    decoded = keyframe_delta_file.decode_streamed(export("4dgs", clip, frames))

    assert decoded.header.duration_sec == pytest.approx(len(frames) / _FPS)
    for number, frame in enumerate(frames):
        imported = keyframe_delta_file.render_at(decoded, (number + 0.5) / _FPS)
        assert np.array_equal(imported["ids"], frame.scene.ids)
        bound = 0.02 * np.median(np.exp(frame.splats.log_scales))  # as in the profile
        assert np.abs(imported["centers"] - frame.splats.positions).max() < 2 * bound
        rotations = np.roll(imported["rotations"], 1, axis=1)
        assert compare_rotations(rotations, frame.splats.rotations) > 1 - 1e-5
        assert imported["scales"] == pytest.approx(np.exp(frame.splats.log_scales), rel=0.01)
        assert imported["rgb"] == pytest.approx(compute_colors(frame.splats), abs=_COLOR_STEP)
        assert imported["opacity"] == pytest.approx(
            compute_opacities(frame.splats), abs=_COLOR_STEP
        )


def test_numpy_reads_npz():
    clip, frames = make_clip()
    with np.load(io.BytesIO(export("npz", clip, frames)), allow_pickle=False) as arrays:
        assert np.array_equal(arrays["positions"], dequantize(frames[-1].scene).positions)


@pytest.mark.parametrize("name", ["glb", "4dgs"])
def test_scales_beyond_the_range_of_floats_are_written_as_finite_numbers(name, tmp_path):
    """Infinity is not allowed in glTF, and fourdgs cannot quantize it."""
    fourdgs = pytest.importorskip("fourdgs")
    clip, frames = make_clip()
    splats = frames[-1].splats
    log_scales = splats.log_scales.copy()
    log_scales[0], log_scales[1] = 128, -128
    data = export(name, clip, [Frame(frames[-1].scene, replace(splats, log_scales=log_scales))])
    if name == "glb":
        (tmp_path / "frame.glb").write_bytes(data)
        scales = fourdgs.from_gltf(str(tmp_path / "frame.glb")).gaussians.scales
    else:
        imported_splats, _ = next(iter(read_4dgs(data).read()))
        scales = np.exp(imported_splats.log_scales)

    assert np.isfinite(scales).all()
    assert np.log(scales.max()) == pytest.approx(80, rel=1e-2)


def test_frames_that_fourdgs_cannot_quantize_are_rejected():
    clip, frames = make_clip()
    frame = frames[-1]
    positions = frame.splats.positions * np.float32(1e30)  # too large for the scales

    with pytest.raises(ExportError, match="fourdgs cannot write the frames"):
        export("4dgs", clip, [Frame(frame.scene, replace(frame.splats, positions=positions))])
