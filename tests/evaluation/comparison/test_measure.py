import io
import shutil
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.datasets.errors import CaptureError
from quarc_ref.encoder.scenes.edits import Edit, Similarity
from quarc_ref.encoder.scenes.encode_scenes import SceneOptions
from quarc_ref.encoder.scenes.fit_edit import encode_edited
from quarc_ref.evaluation.comparison.entries import EntryError, Label
from quarc_ref.evaluation.comparison.open_entries import EntrySource
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.evaluation.metrics import MAX_DECIBELS
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.export.errors import UnreadableFramesError
from quarc_ref.streams.source import BytesSource
from tests.cli.commands import run
from tests.evaluation.capture_streams import write_stream
from tests.evaluation.comparison.conftest import CAMERAS
from tests.evaluation.conftest import ignore_progress


def _list_means(comparison, name="psnr"):
    return [entry.quality.mean()[name] for entry in comparison.measured_entries]


def test_a_stream_has_the_same_figures_as_in_eval(method_outputs, compare):
    outputs = method_outputs.folder
    comparison = compare(outputs / "a.quarc", outputs / "plys", capture=method_outputs.capture)
    evaluation = evaluate_stream(
        (outputs / "a.quarc").read_bytes(), method_outputs.capture, ignore_progress
    )

    assert comparison.measured_entries[0].quality.per_camera == evaluation.quality.per_camera
    assert comparison.frames == (0, 1, 2, 3)
    assert comparison.cameras == ("cam01", "cam04")


def test_ply_files_and_renders_have_the_quality_of_the_stream(method_outputs, compare):
    outputs = method_outputs.folder
    comparison = compare(
        *(outputs / name for name in ("a.quarc", "plys", "renders", "by_frame")),
        capture=method_outputs.capture,
    )
    stream, plys, renders, by_frame = _list_means(comparison)

    assert plys == pytest.approx(stream, abs=1e-4)
    assert renders == pytest.approx(stream, abs=0.02)  # rounded to 8 bits
    assert by_frame == renders
    assert [entry.info.kind for entry in comparison.measured_entries] == [
        "stream", "PLY per frame", "renders", "renders",
    ]  # fmt: skip


def test_every_stream_is_rendered_for_its_own_cameras(method_outputs, compare, tmp_path):
    outputs = method_outputs.folder
    sink, data = io.BytesIO(), (outputs / "a.quarc").read_bytes()
    turn = Similarity.from_matrix(np.array([[0.0, 0, 1, 3], [0, 1, 0, 0], [-1, 0, 0, 0]]))
    encode_edited(BytesSource(data), sink, Edit(similarity=turn), SceneOptions())
    (tmp_path / "turned.quarc").write_bytes(sink.getvalue())
    comparison = compare(
        tmp_path / "turned.quarc", outputs / "a.quarc", outputs / "plys",
        capture=method_outputs.capture,
    )  # fmt: skip
    turned, stream, plys = _list_means(comparison)

    assert turned == pytest.approx(stream, abs=0.1)
    assert plys == pytest.approx(stream, abs=1e-4)  # in the coordinates of the capture
    (copy,) = _list_means(compare(tmp_path / "turned.quarc", outputs / "a.quarc"))
    assert copy > 40


def test_byte_counts_are_file_sizes(method_outputs, compare):
    outputs = method_outputs.folder
    renders = EntrySource(Label("renders", "renders"), outputs / "renders", 1234)
    comparison = compare(
        outputs / "a.quarc", outputs / "plys", renders, capture=method_outputs.capture
    )
    plys = sum(path.stat().st_size for path in (outputs / "plys").iterdir())

    sizes = [entry.info.byte_count for entry in comparison.measured_entries]
    assert sizes == [(outputs / "a.quarc").stat().st_size, plys, 1234]


def test_frames_of_fourdgs_have_nearly_the_same_quality(method_outputs, compare, tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    del fourdgs
    from fourdgs.keyframe_delta_file import write_sequence

    from quarc_ref.streams import decode
    from rate.keyframe_deltas import _make_samples

    samples = list(_make_samples(decode((method_outputs.folder / "a.quarc").read_bytes())))
    (tmp_path / "a.4dgs").write_bytes(write_sequence(samples, 4 * samples[1].t0))
    comparison = compare(
        method_outputs.folder / "plys", tmp_path / "a.4dgs", capture=method_outputs.capture
    )
    ply_psnr, fourdgs_psnr = _list_means(comparison)

    assert comparison.frames == (0, 1, 2, 3)
    assert fourdgs_psnr == pytest.approx(ply_psnr, abs=0.5)


def test_a_fourdgs_file_begins_at_the_frame_in_its_sequence_json(method_outputs, compare, tmp_path):
    pytest.importorskip("fourdgs")
    stream = method_outputs.folder / "a.quarc"
    for name, frames in (("all", "0:4"), ("late", "2:4")):
        options = ("--to", "4dgs", "--frames", frames, "-o", tmp_path / name)
        assert run("decode", stream, *options).exit_code == 0
    comparison = compare(
        *(tmp_path / name / "frames.4dgs" for name in ("all", "late")),
        capture=method_outputs.capture,
    )
    of_all, of_late = _list_means(comparison)

    assert comparison.frames == (2, 3)
    assert of_late == pytest.approx(of_all, abs=1e-3)


def test_without_a_capture_the_first_entry_is_the_truth(method_outputs, compare):
    outputs = method_outputs.folder
    comparison = compare(outputs / "plys", outputs / "a.quarc", outputs / "renders")

    assert [entry.label.method for entry in comparison.measured_entries] == ["a", "renders"]
    assert comparison.truth_description == "the renders of plys"
    stream_psnr, renders_psnr = _list_means(comparison)
    assert stream_psnr == MAX_DECIBELS
    assert 50 < renders_psnr < 70
    assert _list_means(comparison, "moving_psnr") == [None, None]


def test_only_common_frames_are_compared(method_outputs, compare, tmp_path):
    shutil.copytree(method_outputs.folder / "plys", tmp_path / "few")
    (tmp_path / "few" / "point_cloud_00000.ply").unlink()
    stream = method_outputs.folder / "a.quarc"

    common = compare(stream, tmp_path / "few", capture=method_outputs.capture)
    assert common.frames == (1, 2, 3)
    assert common.remarks[-1].endswith(": 0 to 3 in a; 1 to 3 in few")
    limited = compare(stream, tmp_path / "few", capture=method_outputs.capture, span=(0, 3))
    assert limited.frames == (1, 2)
    with pytest.raises(
        EntryError, match="range has none of the frames that all entries have, 1 to 3"
    ):
        compare(stream, tmp_path / "few", capture=method_outputs.capture, span=(0, 1))
    for frame in (1, 2, 3):
        path = tmp_path / "few" / f"point_cloud_0000{frame}.ply"
        path.rename(path.with_stem(f"point_cloud_0001{frame}"))
    with pytest.raises(EntryError, match=r"common \(0 to 3 in a, the capture; 11 to 13 in few\)"):
        compare(stream, tmp_path / "few", capture=method_outputs.capture)


def test_frames_numbered_from_1_are_pointed_out(method_outputs, compare, tmp_path):
    for frame, path in enumerate(sorted((method_outputs.folder / "plys").iterdir()), start=1):
        shutil.copy(path, tmp_path / f"{frame}.ply")
    plys, capture = method_outputs.folder / "plys", method_outputs.capture
    one_based = compare(tmp_path, tmp_path, capture=capture)
    (tmp_path / "2.ply").unlink()
    with_gap = compare(method_outputs.folder / "a.quarc", tmp_path)

    assert one_based.frames == (1, 2, 3)
    remark = f": 1 to 4 in {tmp_path.name}; 0 to 3 in the capture"
    assert one_based.remarks[0].endswith(remark)
    remark = f": 0 to 3 in a; 1 to 4 with gaps in {tmp_path.name}"
    assert with_gap.remarks[0].endswith(remark)
    assert compare(plys, plys, capture=capture).remarks == ()


def test_a_comparison_has_views_of_every_entry_for_the_page(method_outputs, compare):
    comparison = compare(
        method_outputs.folder / "a.quarc",
        method_outputs.folder / "renders",
        capture=method_outputs.capture,
    )
    view_keys = [
        (compared_view.camera, compared_view.frame) for compared_view in comparison.shown_views
    ]

    assert view_keys == [("cam01", 0), ("cam01", 2), ("cam04", 2), ("cam01", 3)]
    for view in comparison.shown_views:
        assert view.truth.shape == (32, 48, 3)
        assert np.abs(view.pictures[0] - view.pictures[1]).max() < 1 / 254


def test_suffixes_of_ply_files_may_be_in_upper_case(method_outputs, compare, tmp_path):
    for path in (method_outputs.folder / "plys").iterdir():
        shutil.copy(path, (tmp_path / path.name).with_suffix(".PLY"))
    comparison = compare(
        method_outputs.folder / "a.quarc", tmp_path, capture=method_outputs.capture, span=(0, 1)
    )

    assert comparison.measured_entries[1].info.kind == "PLY per frame"


def test_cameras_can_be_chosen(method_outputs, compare):
    stream, plys = method_outputs.folder / "a.quarc", method_outputs.folder / "plys"
    comparison = compare(stream, plys, capture=method_outputs.capture, cameras=("cam00",))

    assert comparison.cameras == ("cam00",)
    with pytest.raises(EntryError, match="no camera cam09; the cameras are cam00, cam01"):
        compare(stream, plys, capture=method_outputs.capture, cameras=("cam09",))


def _truncate_ply(folder):
    path = folder / "point_cloud_00001.ply"
    path.write_bytes(path.read_bytes()[:-4])


def _shrink_pictures(folder):
    from quarc_ref.datasets.video_writer import build_png

    for path in folder.rglob("*.png"):
        path.write_bytes(build_png(np.zeros((16, 24, 3), dtype=np.uint8)))


@pytest.mark.parametrize(
    ("source", "damage", "message"),
    [
        ("plys", _truncate_ply, "point_cloud_00001.ply: the file ends before the last"),
        ("plys", lambda it: (it / "first.ply").write_bytes(b""), "first.ply has no frame number"),
        ("plys", lambda it: (it / "x_1.ply").write_bytes(b""), "have the same frame number"),
        ("renders", _shrink_pictures, "24x16"),
        ("renders", lambda it: shutil.rmtree(it / "cam04"), "pictures of cam01, cam04"),
    ],
)
def test_an_unusable_entry_is_named_in_the_error(
    source, damage, message, method_outputs, compare, tmp_path
):
    folder = shutil.copytree(method_outputs.folder / source, tmp_path / source)
    damage(folder)

    with pytest.raises((EntryError, UnreadableFramesError, CaptureError), match=message):
        compare(method_outputs.folder / "a.quarc", folder, capture=method_outputs.capture)


def test_a_folder_that_is_the_truth_or_holds_one_file_is_reported(
    method_outputs, compare, tmp_path
):
    stream = method_outputs.folder / "a.quarc"
    (tmp_path / "whole").mkdir()
    (tmp_path / "whole" / "frames.4dgs").write_bytes(b"")

    with pytest.raises(EntryError, match=r"is a capture .*use --capture "):
        compare(stream, method_outputs.capture)
    with pytest.raises(EntryError, match=r"use the file .*frames\.4dgs"):
        compare(stream, tmp_path / "whole")


def test_entries_without_a_stream_need_the_cameras_of_a_capture(method_outputs, compare):
    plys, renders = method_outputs.folder / "plys", method_outputs.folder / "renders"

    with pytest.raises(EntryError, match="--capture"):
        compare(plys, renders)
    comparison = compare(plys, plys, capture=method_outputs.capture)
    assert comparison.cameras == ("cam00",)


def test_a_stream_without_cameras_is_rendered_for_those_of_another_stream(
    method_outputs, compare, tmp_path
):
    bare, stream = tmp_path / "bare.quarc", method_outputs.folder / "a.quarc"
    bare.write_bytes(write_stream([], 4))
    for paths in ((bare, stream), (stream, bare)):
        assert compare(*paths).cameras == CAMERAS

    for cameras in ((), ("cam01",)):
        with pytest.raises(EntryError, match="no stream has cameras, so there are none"):
            compare(bare, bare, cameras=cameras)
    with pytest.raises(MismatchError, match=r"bare\.quarc: the stream has no cameras"):
        compare(bare, stream, capture=method_outputs.capture)


def test_a_stream_without_held_out_cameras_is_compared_on_given_cameras(
    method_outputs, compare, tmp_path
):
    path = tmp_path / "all.quarc"
    cameras = [replace(camera, held_out=False) for camera in method_outputs.cameras]
    path.write_bytes(write_stream(cameras, 4))

    comparison = compare(path, capture=method_outputs.capture, cameras=("cam01",))
    assert comparison.cameras == ("cam01",)


def test_streams_of_other_cameras_are_not_compared(method_outputs, compare, tmp_path):
    from tests.evaluation.capture_streams import write_stream

    other_stream = tmp_path / "b.quarc"
    for cameras in (method_outputs.cameras[::-1], method_outputs.cameras[:-1]):
        other_stream.write_bytes(write_stream(cameras, 4))
        with pytest.raises(MismatchError, match="have different cameras"):
            compare(method_outputs.folder / "a.quarc", other_stream)


def test_a_fourdgs_file_of_births_is_read_with_its_spherical_harmonics(tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    from quarc_ref.export.fourdgs_file import read_4dgs

    rng = np.random.default_rng(4)
    count = 5
    rotations = np.tile(np.array([0.6, 0, 0, 0.8], dtype=np.float32), (count, 1))
    levels = rng.integers(0, 256, (count, 9), dtype=np.uint8)
    gaussians = fourdgs.GaussianSet(
        positions=rng.uniform(-1, 1, (count, 3)).astype(np.float32),
        scales=np.full((count, 3), 0.1, dtype=np.float32),
        rotations=rotations,
        colors=np.full((count, 4), 0.25, dtype=np.float32),
        motions=np.full((count, 3), 0.5, dtype=np.float32),
        mu_t=np.zeros(count, dtype=np.float32),
        sigma_t=np.full(count, np.inf, dtype=np.float32),
        win_lo=np.zeros(count),
        win_hi=np.full(count, 2.0),
        sh=levels,
        sh_degree=1,
    )
    fourdgs.write(tmp_path / "a.4dgs", gaussians, 2.0)
    sequence = read_4dgs((tmp_path / "a.4dgs").read_bytes(), 1.0)
    (first, _), (later, _) = sequence.read()

    assert sequence.count == 2
    assert later.positions == pytest.approx(first.positions + 0.5, abs=1e-2)
    assert first.rotations == pytest.approx(np.roll(rotations, 1, axis=1), abs=1e-2)
    assert np.exp(first.log_scales) == pytest.approx(np.full((count, 3), 0.1), rel=0.05)
    assert 1 / (1 + np.exp(-first.opacities)) == pytest.approx(np.full(count, 0.25), abs=0.01)
    # The file stores SH by channel and then coefficient; `Splats` by coefficient and then channel.
    written_order = np.lexsort(gaussians.positions.T)
    read_order = np.lexsort(first.positions.T)
    expected = (levels / 255 * 8 - 4).reshape(count, 3, 3).transpose(0, 2, 1)
    assert first.sh[read_order, 1:] == pytest.approx(expected[written_order], abs=0.2)


def test_a_file_that_is_not_fourdgs_is_rejected_by_name(method_outputs, compare, tmp_path):
    pytest.importorskip("fourdgs")
    (tmp_path / "a.4dgs").write_bytes(b"\x00" * 64)

    with pytest.raises(UnreadableFramesError, match=r"a\.4dgs"):
        compare(
            method_outputs.folder / "a.quarc", tmp_path / "a.4dgs", capture=method_outputs.capture
        )


@pytest.mark.parametrize("with_capture", [True, False])
def test_streams_that_start_at_different_frames_are_rejected(
    with_capture, method_outputs, compare, tmp_path
):
    capture = method_outputs.capture if with_capture else None
    later_path = tmp_path / "later.quarc"
    later_path.write_bytes(write_stream(method_outputs.cameras, 2, {"start": "2"}))

    with pytest.raises(EntryError, match=r"a begins at frame 0 .* later at frame 2"):
        compare(method_outputs.folder / "a.quarc", later_path, capture=capture)


def test_streams_are_compared_on_cameras_that_none_was_trained_on(
    method_outputs, compare, tmp_path
):
    other_paths = [tmp_path / "b.quarc", tmp_path / "c.quarc"]
    for path, held_out_names in zip(other_paths, [("cam04", "cam03"), ("cam03",)], strict=True):
        cameras = [
            replace(camera, held_out=camera.name in held_out_names)
            for camera in method_outputs.cameras
        ]
        path.write_bytes(write_stream(cameras, 4))
    paths = [method_outputs.folder / "a.quarc", *other_paths]
    capture = method_outputs.capture

    assert compare(*paths[:2], capture=capture).cameras == ("cam04",)
    with pytest.raises(EntryError, match="no camera is held out of all streams"):
        compare(*paths, capture=capture)
    assert compare(*paths, capture=capture, cameras=("cam03",)).cameras == ("cam03",)
    assert compare(*paths).cameras == compare(paths[0], paths[0]).cameras
