"""Tests of the frames on which entries are compared."""

import os
import shutil

import pytest

from quarc_ref.evaluation.comparison.entries import EntryError
from quarc_ref.evaluation.comparison.gaussian_files import list_plys
from quarc_ref.evaluation.same_capture import MismatchError
from tests.evaluation.capture_streams import write_stream


def test_only_common_frames_are_compared(method_outputs, compare, tmp_path):
    shutil.copytree(method_outputs.folder / "plys", tmp_path / "few")
    (tmp_path / "few" / "point_cloud_00000.ply").unlink()
    stream = method_outputs.folder / "a.quarc"

    common = compare(stream, tmp_path / "few", capture=method_outputs.capture)
    assert common.frames == (1, 2, 3)
    assert common.remarks[-2].endswith(": 0 to 3 in a; 1 to 3 in few")
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


def test_only_the_compared_frames_must_be_in_the_capture(method_outputs, compare, tmp_path):
    path, capture = tmp_path / "long.quarc", method_outputs.capture
    path.write_bytes(write_stream(method_outputs.cameras, 6))

    assert compare(path, path, capture=capture, span=(2, 4)).frames == (2, 3)
    with pytest.raises(MismatchError, match="frame 5 of the stream is not in the capture"):
        compare(path, path, capture=capture)


@pytest.mark.skipif(os.name == "nt", reason="no named pipes")
def test_a_named_pipe_is_no_frame(tmp_path):
    (tmp_path / "0.ply").write_bytes(b"")
    os.mkfifo(tmp_path / "1.ply")

    assert list_plys(tmp_path) == [tmp_path / "0.ply"]


def test_hidden_files_are_no_frames(tmp_path):
    (tmp_path / "frame_0000.ply").write_bytes(b"")
    (tmp_path / "._frame_0000.ply").write_bytes(b"")

    assert list_plys(tmp_path) == [tmp_path / "frame_0000.ply"]


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


def test_frames_numbered_from_1_are_pointed_out_if_the_capture_has_these_numbers(
    method_outputs, compare, tmp_path
):
    plys, capture = sorted((method_outputs.folder / "plys").iterdir()), method_outputs.capture
    for frame, path in enumerate(plys[:3], start=1):
        shutil.copy(path, tmp_path / f"{frame}.ply")
    (remark,) = compare(tmp_path, tmp_path, capture=capture).remarks
    (tmp_path / "1.ply").unlink()

    assert remark.startswith(f"{tmp_path.name} has no frame 0, ")
    assert compare(tmp_path, tmp_path, capture=capture).remarks == ()


@pytest.mark.parametrize("with_capture", [True, False])
def test_streams_that_start_at_different_frames_are_rejected(
    with_capture, method_outputs, compare, tmp_path
):
    capture = method_outputs.capture if with_capture else None
    later_path = tmp_path / "later.quarc"
    later_path.write_bytes(write_stream(method_outputs.cameras, 2, {"start": "2"}))

    with pytest.raises(EntryError, match=r"a begins at frame 0 .* later at frame 2"):
        compare(method_outputs.folder / "a.quarc", later_path, capture=capture)
