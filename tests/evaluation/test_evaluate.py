import shutil
from dataclasses import replace

import numpy as np
import pytest
from skimage.metrics import peak_signal_noise_ratio

from quarc_ref.datasets import choose_points as choose_points_module
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.evaluate import EvaluationOptions, evaluate_stream
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.format.errors import BitstreamError
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import decode
from tests.datasets import scenes
from tests.evaluation.capture_streams import write_stream
from tests.evaluation.conftest import ignore_progress


def _read_truth(folder, camera, frame):
    """The picture of a frame, decoded from its video."""
    return scenes.read_video(folder / f"{camera}.mp4")[frame] / 255


def test_quality_is_the_mean_over_the_held_out_cameras(evaluation, stream, capture, folder):
    for scene, frame_psnr in zip(decode(stream), evaluation.quality.psnr, strict=True):
        splats, psnr = dequantize(scene), []
        for index in (1, 3):
            camera = capture.cameras[index]
            truth = _read_truth(folder, camera.name, scene.frame)
            picture = np.clip(render_picture(splats, camera), 0, 1).astype(np.float64)
            psnr.append(peak_signal_noise_ratio(truth, picture, data_range=1.0))

        # The stream stores poses as float32, the capture as float64.
        assert frame_psnr == pytest.approx(np.mean(psnr), abs=1e-3)


def test_the_first_middle_and_last_frame_of_the_first_held_out_camera_are_shown(evaluation, folder):
    assert [view.frame for view in evaluation.shown_views] == [0, 2, 3]
    assert {view.camera for view in evaluation.shown_views} == {"cam01"}
    for view in evaluation.shown_views:
        assert view.truth == pytest.approx(_read_truth(folder, "cam01", view.frame), abs=1e-6)
        assert view.decoded.shape == view.truth.shape
        assert view.decoded.min() >= 0
        assert view.decoded.max() <= 1


def test_the_summary_is_of_the_stream_itself(evaluation, stream):
    assert evaluation.summary == inspect_stream(stream)


def test_json_has_a_number_for_each_frame_and_their_means(evaluation):
    printed = evaluation.quality.as_json(evaluation.frames)

    assert printed["psnr_per_frame"] == list(evaluation.quality.psnr)
    assert printed["psnr"] == pytest.approx(np.mean(evaluation.quality.psnr))
    assert printed["ssim"] == pytest.approx(np.mean(evaluation.quality.ssim))
    assert len(printed["ssim_per_frame"]) == 4


def test_both_passes_report_progress(stream, folder):
    reports = []
    evaluate_stream(stream, folder, lambda *report: reports.append(report))

    stages = [(stage, done, 4) for stage in ("inspect", "evaluate") for done in range(1, 5)]
    assert reports == stages


def test_a_stream_is_measured_at_its_own_resolution(folder):
    half = open_capture(folder, CaptureOptions(downscale=2))
    evaluation = evaluate_stream(write_stream(half.cameras, 2), folder, ignore_progress)

    assert evaluation.shown_views[0].truth.shape == (16, 24, 3)
    assert evaluation.shown_views[0].truth == pytest.approx(half.image(0, 0) / 255, abs=1e-6)


def test_initial_points_are_computed_only_as_they_were_for_encoding(folder, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    triangulations = []

    def triangulate(cameras, _pictures):
        triangulations.append((cameras[0].lens.width, [camera.name for camera in cameras]))
        return scenes.make_plane_points()

    monkeypatch.setattr(choose_points_module, "triangulate", triangulate)
    bare = shutil.copytree(folder, tmp_path / "bare", ignore=shutil.ignore_patterns("*.ply"))
    encoded = open_capture(bare, CaptureOptions(downscale=2, held_out=("cam04",)))
    evaluate_stream(write_stream(encoded.cameras, 1), bare, ignore_progress)

    assert triangulations == [(24, ["cam00", "cam01", "cam03"])]


def test_the_cameras_of_the_stream_are_used(capture, folder):
    moved = [replace(camera, translation=(50.0, 0.0, 4.0)) for camera in capture.cameras]
    evaluation = evaluate_stream(write_stream(moved, 1), folder, ignore_progress)

    assert evaluation.shown_views[0].decoded.max() == 0


def _as_training_camera(camera):
    return replace(camera, held_out=False)


@pytest.mark.parametrize(
    ("change", "frames", "message"),
    [
        (
            lambda cameras: [_as_training_camera(camera) for camera in cameras],
            2,
            "no held-out camera",
        ),
        (lambda _: [], 2, r"has no cameras, .*: import takes cameras from sequence\.json$"),
        (lambda cameras: cameras, 0, "no frame"),
        (lambda cameras: cameras, 5, "frame 4 of the stream is not in the capture.*--frames 0:4$"),
        (lambda cameras: cameras[:3], 2, "cameras .* differ: only the capture has cam04$"),
        (
            lambda cameras: [*cameras[:3], replace(cameras[3], name="cam07")],
            2,
            "cameras .* differ: only the capture has cam04; only the stream has cam07$",
        ),
        (lambda cameras: cameras[::-1], 2, "cameras .* differ: they have different orders"),
        (
            lambda cameras: [*cameras[:3], replace(cameras[3], width=40)],
            2,
            "pictures of cam04 have 48 x 32 pixels in the capture, but 40 x 32",
        ),
        (lambda cameras: [replace(camera, width=1) for camera in cameras], 2, "downscaled by 48"),
    ],
)
def test_streams_and_captures_that_do_not_match_are_rejected(change, frames, message, folder):
    data = write_stream(change(open_capture(folder).cameras), frames)

    with pytest.raises(MismatchError, match=message):
        evaluate_stream(data, folder, ignore_progress)


def test_only_the_measured_frames_must_be_in_the_capture(capture, folder):
    data = write_stream(capture.cameras, 6)
    evaluation = evaluate_stream(
        data, folder, ignore_progress, EvaluationOptions((2, capture.frame_count))
    )

    assert evaluation.frames == (2, 3)
    with pytest.raises(MismatchError, match="frame 5 of the stream is not in the capture"):
        evaluate_stream(data, folder, ignore_progress, EvaluationOptions((2, 5)))


def test_a_range_without_frames_is_rejected(stream, folder):
    with pytest.raises(MismatchError, match="no frames in this range; its frames are 0 to 3"):
        evaluate_stream(stream, folder, ignore_progress, EvaluationOptions((4, None)))


def test_a_damaged_stream_is_rejected_before_the_capture_is_read(stream, tmp_path):
    with pytest.raises(BitstreamError):
        evaluate_stream(stream[:-1], tmp_path / "none", ignore_progress)


def test_an_unreadable_capture_is_named(stream, tmp_path):
    with pytest.raises(CaptureError):
        evaluate_stream(stream, tmp_path, ignore_progress)
