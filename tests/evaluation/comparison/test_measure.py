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
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.export.errors import UnreadableFramesError
from quarc_ref.streams.source import BytesSource
from tests.evaluation.capture_streams import write_stream
from tests.evaluation.comparison.conftest import CAMERAS
from tests.evaluation.conftest import ignore_progress


def _list_means(comparison, name="psnr"):
    return [entry.quality.mean()[name] for entry in comparison.measured_entries]


def test_a_stream_has_the_same_figures_as_in_eval(method_outputs, compare):
    outputs, reports = method_outputs.folder, []
    comparison = compare(
        outputs / "a.quarc",
        outputs / "plys",
        capture=method_outputs.capture,
        on_progress=lambda *report: reports.append(report),
    )
    evaluation = evaluate_stream(
        (outputs / "a.quarc").read_bytes(), method_outputs.capture, ignore_progress
    )

    assert comparison.measured_entries[0].quality.per_camera == evaluation.quality.per_camera
    assert comparison.frames == (0, 1, 2, 3)
    assert comparison.cameras == ("cam01", "cam04")
    assert reports == [("compare", count, 4) for count in (1, 2, 3, 4)]


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


def test_without_a_capture_the_first_entry_is_the_truth(method_outputs, compare):
    outputs = method_outputs.folder
    comparison = compare(outputs / "plys", outputs / "a.quarc", outputs / "renders")

    assert [entry.label.method for entry in comparison.measured_entries] == ["a", "renders"]
    assert comparison.truth_description == "the renders of plys"
    stream_psnr, renders_psnr = _list_means(comparison)
    assert stream_psnr > 95  # quaternions in PLY files were normalized, and differ in the last bit
    assert 50 < renders_psnr < 70
    assert _list_means(comparison, "moving_psnr") == [None, None]


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
        ("renders", _shrink_pictures, "24 x 16"),
        (
            "renders",
            lambda it: shutil.rmtree(it / "cam04"),
            "has pictures of cam01, but none of cam04",
        ),
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
    with pytest.raises(EntryError, match=r"cam01, cam04 of a; cam03, cam04 of b; cam03 of c"):
        compare(*paths, capture=capture)
    assert compare(*paths, capture=capture, cameras=("cam03",)).cameras == ("cam03",)
    assert compare(*paths).cameras == compare(paths[0], paths[0]).cameras
