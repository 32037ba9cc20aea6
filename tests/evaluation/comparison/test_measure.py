import shutil

import numpy as np
import pytest

from quarc_ref.datasets.errors import CaptureError
from quarc_ref.evaluation.comparison.entries import EntryError, Label
from quarc_ref.evaluation.comparison.open_entries import EntrySource
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.evaluation.metrics import MAX_DECIBELS
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.export.errors import UnreadableFramesError
from tests.evaluation.conftest import ignore


def _means(comparison, name="psnr"):
    return [each.quality.mean()[name] for each in comparison.measured]


def test_a_stream_has_the_same_figures_as_in_eval(rivals, compare):
    place = rivals.place
    comparison = compare(place / "a.quarc", place / "plys", capture=rivals.capture)
    evaluation = evaluate_stream((place / "a.quarc").read_bytes(), rivals.capture, ignore)

    assert comparison.measured[0].quality.per_camera == evaluation.quality.per_camera
    assert comparison.frames == (0, 1, 2, 3)
    assert comparison.cameras == ("cam01", "cam04")


def test_its_frames_as_ply_files_and_as_renders_have_the_same_quality(rivals, compare):
    place = rivals.place
    comparison = compare(
        *(place / name for name in ("a.quarc", "plys", "renders", "by_frame")),
        capture=rivals.capture,
    )
    stream, plys, renders, by_frame = _means(comparison)

    assert plys == pytest.approx(stream, abs=1e-4)
    assert renders == pytest.approx(stream, abs=0.02)  # rounded to 8 bits
    assert by_frame == renders
    assert [each.info.kind for each in comparison.measured] == [
        "stream", "PLY per frame", "renders", "renders",
    ]  # fmt: skip


def test_bytes_are_those_of_the_files(rivals, compare):
    place = rivals.place
    renders = EntrySource(Label("renders", "renders"), place / "renders", 1234)
    comparison = compare(place / "a.quarc", place / "plys", renders, capture=rivals.capture)
    plys = sum(path.stat().st_size for path in (place / "plys").iterdir())

    sizes = [each.info.byte_count for each in comparison.measured]
    assert sizes == [(place / "a.quarc").stat().st_size, plys, 1234]


def test_frames_of_fourdgs_have_nearly_the_same_quality(rivals, compare, tmp_path):
    fourdgs = pytest.importorskip("fourdgs")
    del fourdgs
    from fourdgs.keyframe_delta_file import write_sequence

    from quarc_ref.streams import decode
    from rate.keyframe_deltas import _make_samples

    samples = list(_make_samples(decode((rivals.place / "a.quarc").read_bytes())))
    (tmp_path / "a.4dgs").write_bytes(write_sequence(samples, 4 * samples[1].t0))
    comparison = compare(rivals.place / "plys", tmp_path / "a.4dgs", capture=rivals.capture)
    ours, theirs = _means(comparison)

    assert comparison.frames == (0, 1, 2, 3)
    assert theirs == pytest.approx(ours, abs=0.5)


def test_without_a_capture_the_first_entry_is_the_truth(rivals, compare):
    place = rivals.place
    comparison = compare(place / "plys", place / "a.quarc", place / "renders")

    assert [each.label.method for each in comparison.measured] == ["a", "renders"]
    assert comparison.truth == "the renders of plys"
    same, rounded = _means(comparison)
    assert same == MAX_DECIBELS
    assert 50 < rounded < 70
    assert _means(comparison, "moving_psnr") == [None, None]


def test_only_common_frames_are_compared(rivals, compare, tmp_path):
    shutil.copytree(rivals.place / "plys", tmp_path / "few")
    (tmp_path / "few" / "point_cloud_00000.ply").unlink()
    stream = rivals.place / "a.quarc"

    assert compare(stream, tmp_path / "few", capture=rivals.capture).frames == (1, 2, 3)
    few = compare(stream, tmp_path / "few", capture=rivals.capture, span=(0, 3))
    assert few.frames == (1, 2)
    with pytest.raises(
        EntryError, match=r"the entries have no frame in common \(a: 0 to 3; few: 1 to 3\)"
    ):
        compare(stream, tmp_path / "few", capture=rivals.capture, span=(0, 1))


def test_views_of_every_entry_are_kept_for_inspection(rivals, compare):
    comparison = compare(rivals.place / "a.quarc", rivals.place / "renders", capture=rivals.capture)
    places = [(it.camera, it.frame) for it in comparison.shown]

    assert places == [("cam01", 0), ("cam01", 2), ("cam04", 2), ("cam01", 3)]
    for view in comparison.shown:
        assert view.truth.shape == (32, 48, 3)
        assert np.abs(view.pictures[0] - view.pictures[1]).max() < 1 / 254


def test_cameras_can_be_chosen(rivals, compare):
    stream, plys = rivals.place / "a.quarc", rivals.place / "plys"
    comparison = compare(stream, plys, capture=rivals.capture, cameras=("cam00",))

    assert comparison.cameras == ("cam00",)
    with pytest.raises(EntryError, match="no camera cam09; the cameras are cam00, cam01"):
        compare(stream, plys, capture=rivals.capture, cameras=("cam09",))


def _spoil_ply(folder):
    path = folder / "point_cloud_00001.ply"
    path.write_bytes(path.read_bytes()[:-4])


def _shrink(folder):
    from quarc_ref.datasets.video_writer import build_png

    for path in folder.rglob("*.png"):
        path.write_bytes(build_png(np.zeros((16, 24, 3), dtype=np.uint8)))


@pytest.mark.parametrize(
    ("source", "spoil", "message"),
    [
        ("plys", _spoil_ply, "point_cloud_00001.ply: it ends before the last"),
        ("plys", lambda it: (it / "first.ply").write_bytes(b""), "first.ply has no frame number"),
        ("plys", lambda it: (it / "x_1.ply").write_bytes(b""), "have the same frame number"),
        ("renders", _shrink, "24x16"),
        ("renders", lambda it: shutil.rmtree(it / "cam04"), "pictures of cam01, cam04"),
    ],
)
def test_an_unusable_rival_is_named(source, spoil, message, rivals, compare, tmp_path):
    folder = shutil.copytree(rivals.place / source, tmp_path / source)
    spoil(folder)

    with pytest.raises((EntryError, UnreadableFramesError, CaptureError), match=message):
        compare(rivals.place / "a.quarc", folder, capture=rivals.capture)


def test_a_folder_that_is_the_truth_or_holds_one_file_is_reported(rivals, compare, tmp_path):
    stream = rivals.place / "a.quarc"
    (tmp_path / "whole").mkdir()
    (tmp_path / "whole" / "frames.4dgs").write_bytes(b"")

    with pytest.raises(EntryError, match=r"is a capture .*use --capture "):
        compare(stream, rivals.capture)
    with pytest.raises(EntryError, match=r"name the file in it, .*frames\.4dgs"):
        compare(stream, tmp_path / "whole")


def test_rivals_alone_need_the_cameras_of_a_capture(rivals, compare):
    plys, renders = rivals.place / "plys", rivals.place / "renders"

    with pytest.raises(EntryError, match="--capture"):
        compare(plys, renders)
    alone = compare(plys, plys, capture=rivals.capture)
    assert alone.cameras == ("cam00",)


def test_streams_of_other_cameras_are_not_compared(rivals, compare, tmp_path):
    from tests.evaluation.streams_of_captures import write_stream

    other = tmp_path / "b.quarc"
    other.write_bytes(write_stream(rivals.cameras[::-1], 4))

    with pytest.raises(MismatchError, match="differ in cameras"):
        compare(rivals.place / "a.quarc", other)


def test_a_fourdgs_file_of_births_has_its_harmonics(tmp_path):
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
    found = read_4dgs((tmp_path / "a.4dgs").read_bytes(), 1.0)
    (first, _), (later, _) = found.read()

    assert found.count == 2
    assert later.positions == pytest.approx(first.positions + 0.5, abs=1e-2)
    assert first.rotations == pytest.approx(np.roll(rotations, 1, axis=1), abs=1e-2)
    assert np.exp(first.log_scales) == pytest.approx(np.full((count, 3), 0.1), rel=0.05)
    assert 1 / (1 + np.exp(-first.opacities)) == pytest.approx(np.full(count, 0.25), abs=0.01)
    # Channel by channel in the file, coefficient by coefficient here.
    order = np.lexsort(gaussians.positions.T)
    mine = np.lexsort(first.positions.T)
    expected = (levels / 255 * 8 - 4).reshape(count, 3, 3).transpose(0, 2, 1)
    assert first.sh[mine, 1:] == pytest.approx(expected[order], abs=0.2)


def test_a_file_that_is_not_fourdgs_is_rejected_by_name(rivals, compare, tmp_path):
    pytest.importorskip("fourdgs")
    (tmp_path / "a.4dgs").write_bytes(b"\x00" * 64)

    with pytest.raises(UnreadableFramesError, match=r"a\.4dgs"):
        compare(rivals.place / "a.quarc", tmp_path / "a.4dgs", capture=rivals.capture)
