import re
import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from av.video.reformatter import Colorspace, ColorTrc

from quarc_ref.datasets.agreement import (
    compare_color_matrices,
    compare_frame_rates,
    compare_lengths,
    require_common_frame_rate,
)
from quarc_ref.datasets.errors import FrameRateError, TooFewFramesError
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.datasets.pictures import VideoPictures
from quarc_ref.datasets.video import UNSTATED_MATRIX, VideoReader
from tests.datasets import forgeries, scenes

REGULAR_TIMES = [round(index * 1000 / 30) for index in range(12)]


def make_videos(folder, **times_by_name):
    """Write a video for each camera with frames at times in milliseconds, and open the videos."""
    for name, milliseconds in times_by_name.items():
        forgeries.write_timed_video(folder / f"{name}.mkv", milliseconds)
    return [VideoReader(folder / f"{name}.mkv") for name in times_by_name]


def test_videos_of_the_same_rate_and_length_agree(tmp_path):
    videos = make_videos(tmp_path, cam00=REGULAR_TIMES, cam01=REGULAR_TIMES)

    require_common_frame_rate(videos)
    assert compare_lengths(["cam00", "cam01"], [12, 12]) is None


def test_times_rounded_to_milliseconds_are_regular(tmp_path):
    times = [round(index * 1000 / 240) for index in range(30)]

    require_common_frame_rate(make_videos(tmp_path, cam00=times))


@pytest.mark.parametrize(("last_delay", "is_accepted"), [(2, True), (3, True), (6, False)])
@pytest.mark.parametrize("frame_count", [2, 5, 20])
def test_jitter_of_the_last_frame_is_no_other_rate(tmp_path, frame_count, last_delay, is_accepted):
    times = [round(index * 1000 / 30) for index in range(frame_count)]
    late_times = [*times[:-1], times[-1] + last_delay]
    videos = make_videos(tmp_path, cam00=late_times, cam01=times, cam02=times)

    if is_accepted:
        assert VideoPictures(videos).frames_per_second == videos[1].frames_per_second
        return
    with pytest.raises(FrameRateError, match=r"cam00.mkv has 2\d.* frames per second"):
        require_common_frame_rate(videos)


def test_one_or_two_frames_are_regular(tmp_path):
    require_common_frame_rate(make_videos(tmp_path, cam00=[0], cam01=[0, 33]))


@pytest.mark.parametrize("dropped_frame", [1, 5, 10])
def test_a_dropped_frame_makes_the_rate_variable(tmp_path, dropped_frame):
    times = REGULAR_TIMES[:dropped_frame] + REGULAR_TIMES[dropped_frame + 1 :]
    videos = make_videos(tmp_path, cam00=REGULAR_TIMES, cam01=times)

    with pytest.raises(FrameRateError) as error_info:
        require_common_frame_rate(videos)
    assert re.search(
        r"cam01.mkv has a variable frame rate: its frames last from 33.0 to 6[67].0 ms; convert it "
        r"\(ffmpeg -i cam01.mkv -vf fps=30 ",
        str(error_info.value),
    )
    assert "cam00" not in str(error_info.value)


@pytest.mark.parametrize(
    ("constant_milliseconds", "advised_rate"), [(1000 / 30, "30"), (1001 / 30, "29.97"), (40, "25")]
)
def test_videos_of_variable_rate_are_to_be_converted_to_the_rate_of_the_others(
    constant_milliseconds, advised_rate
):
    times = {
        "cam00": np.arange(8) * constant_milliseconds / 1000,
        "cam01": np.array([0, 1, 2, 4, 5, 6, 7, 8]) / 30,
        "cam02": np.array([0, 1, 2, 3, 5, 6, 7, 8]) / 30,
    }
    videos = [
        SimpleNamespace(
            path=Path(f"{name}.mp4"),
            frame_times=frame_times,
            time_base_seconds=1e-5,
            frames_per_second=7 / frame_times[-1],
        )
        for name, frame_times in times.items()
    ]

    with pytest.raises(FrameRateError, match=r"cam01.mp4 .*applies to cam02.mp4") as error_info:
        require_common_frame_rate(videos)
    assert f"-i cam01.mp4 -vf fps={advised_rate} " in str(error_info.value)


def test_missing_frames_do_not_reduce_the_advised_rate(tmp_path):
    times = [time for index, time in enumerate(REGULAR_TIMES) if index % 4 != 1]

    with pytest.raises(FrameRateError, match=r"fps=30 "):
        require_common_frame_rate(make_videos(tmp_path, cam00=times, cam01=times))


@pytest.mark.parametrize("timescale", [30, 60, 90])
def test_a_coarse_time_base_does_not_hide_a_dropped_frame(timescale):
    ticks = np.array([index * (timescale // 30) for index in range(1200) if index != 300])
    video = SimpleNamespace(
        path=Path("cam01.mp4"),
        frame_times=ticks / timescale,
        time_base_seconds=1 / timescale,
        frames_per_second=30.0,
    )

    with pytest.raises(FrameRateError, match="variable frame rate"):
        require_common_frame_rate([video])


def test_a_rate_that_changes_by_a_fifth_halfway_is_variable(tmp_path):
    later_times = [REGULAR_TIMES[-1] + round(index * 1000 / 24) for index in range(1, 12)]

    with pytest.raises(FrameRateError, match=r"cam00.mkv .*from 33.0 to 42.0 ms"):
        require_common_frame_rate(make_videos(tmp_path, cam00=REGULAR_TIMES + later_times))


@pytest.fixture
def folder(tmp_path, shots, points):
    """A capture of four cameras with six frames at 30 frames per second."""
    return scenes.write_n3dv(tmp_path / "capture", shots, points=points)


def test_a_video_of_another_rate_is_the_only_one_named(folder, pictures):
    scenes.write_video(folder / "cam03.mp4", pictures[2], rate=25)

    with pytest.raises(FrameRateError) as error_info:
        open_capture(folder)
    assert str(error_info.value).startswith(
        "cam03.mp4 has 25 frames per second, but the others have 30: convert"
    )


def test_a_variable_rate_of_one_camera_is_rejected(folder):
    forgeries.write_timed_video(folder / "cam01.mp4", [0, 33, 67, 167, 200, 233])

    with pytest.raises(FrameRateError, match=r"cam01.mp4 has a variable frame rate.* 100.0 ms"):
        open_capture(folder)


def test_shorter_and_longer_videos_are_named_and_all_are_cut(folder, pictures):
    scenes.write_video(folder / "cam01.mp4", pictures[1][:4])
    scenes.write_video(folder / "cam04.mp4", [*pictures[3], pictures[3][0]])
    capture = open_capture(folder)

    assert capture.require_frames(None) == 4
    (finding,) = capture.findings
    assert finding.kind == "uneven-lengths"
    assert finding.message == (
        "cam01 has 4 frames, cam04 has 7 frames, but the others have 6: only the first 4 frames of "
        'every camera are used; to use the other cameras longer, add "ignored_frames": {"cam01": '
        "[[4, null]]} to quarc-capture.json"
    )


def test_the_remedy_for_a_camera_that_ends_early_uses_the_others_longer(folder, pictures):
    scenes.write_video(folder / "cam01.mp4", pictures[1][:4])
    (finding,) = open_capture(folder).findings

    notes = finding.message.split("longer, add ")[1].split(" to ")[0]
    (folder / "quarc-capture.json").write_text(f"{{{notes}}}")
    capture = open_capture(folder)
    assert (capture.frame_count, capture.findings) == (6, ())


@pytest.mark.parametrize("lengths", [[99, 95, 99, 99], [99, 50, 50, 50], [1, 99, 40, 99]])
def test_other_cameras_are_not_used_longer_for_few_frames_or_by_few(lengths):
    names = ["cam00", "cam01", "cam02", "cam03"]

    assert "longer" not in compare_lengths(names, lengths).message


def test_rates_that_differ_slightly_are_a_finding_when_they_add_up_to_half_a_frame():
    names, rates = ["cam00", "cam01", "cam02"], [30, 30, 30000 / 1001]

    assert compare_frame_rates(names, rates, 499) is None
    finding = compare_frame_rates(names, rates, 3000)
    assert (finding.kind, finding.cameras) == ("frame-rate", ("cam02",))
    assert "in frame 3000 they are up to 3.0 frames out of sync" in finding.message
    assert "fps=30 " in finding.message


def test_the_drift_of_a_camera_is_measured_at_the_last_used_frame(folder, pictures):
    rate = Fraction(300_000, 10_009)
    scenes.write_video(folder / "cam03.mp4", [pictures[2][0]] * 700, rate=rate)
    scenes.write_video(folder / "cam00.mp4", [pictures[0][0]] * 700)
    for name in ("cam01", "cam04"):
        shutil.copy(folder / "cam00.mp4", folder / f"{name}.mp4")
    options = CaptureOptions(max_frames=10)

    assert open_capture(folder, options).findings == ()
    (finding,) = open_capture(folder, replace(options, start=690)).findings
    assert finding.cameras == ("cam03",)


def test_lengths_are_compared_after_the_offsets():
    names, lengths = ["cam00", "cam01", "cam02"], [100, 104, 100]

    assert compare_lengths(names, lengths, [0, 4, 0]) is None
    finding = compare_lengths(names, lengths, [0, 4, 7])
    assert finding.message == (
        "cam01 has 104 frames, but the others have 100: only 93 frames of every camera, beginning "
        'at its offset, are used; to use the other cameras longer, add "ignored_frames": {"cam02": '
        "[[93, null]]} to quarc-capture.json"
    )


@pytest.mark.parametrize(
    ("offsets", "used_frames"),
    [
        ([], "the first frame of every camera is used"),
        ([0, 0, 5], "1 frame of every camera, beginning at its offset, is used"),
    ],
)
def test_a_single_common_frame_is_named_in_the_singular(offsets, used_frames):
    finding = compare_lengths(["cam00", "cam01", "cam02"], [6, 1, 6], offsets)

    message, *_ = finding.message.split("; to use the other cameras longer")
    assert message == f"cam01 has 1 frame, but the others have 6: only {used_frames}"


def test_enough_common_frames_suffice(folder, pictures):
    scenes.write_video(folder / "cam01.mp4", pictures[1][:4])
    capture = open_capture(folder)

    assert [capture.require_frames(requested_count) for requested_count in (1, 4)] == [1, 4]
    assert capture.image(3, 3).shape == (32, 48, 3)
    for requested_count in (0, 5):
        message = rf"{requested_count} frames are requested, but capture .* has 4"
        with pytest.raises(TooFewFramesError, match=message):
            capture.require_frames(requested_count)


def test_the_frames_of_a_limited_capture_are_those_within_the_limit(folder, pictures):
    scenes.write_video(folder / "cam01.mp4", pictures[1][:4])

    capture = open_capture(folder, CaptureOptions(max_frames=3))

    assert (capture.require_frames(None), capture.findings) == (3, ())
    assert open_capture(folder, CaptureOptions(max_frames=5)).findings


def test_of_many_unusual_videos_only_some_are_named():
    names = [f"cam{index:02}" for index in range(14)]
    finding = compare_lengths(names, [3 + index % 7 for index in range(14)])

    assert finding.message.count(" has ") == 5
    assert " and 7 more differ, but the others have 6: " in finding.message
    assert len(finding.cameras) == 12


@pytest.mark.parametrize("transfer", [ColorTrc.SMPTE2084, ColorTrc.ARIB_STD_B67])
def test_hdr_videos_are_named(folder, pictures, transfer):
    scenes.write_video(folder / "cam03.mp4", pictures[2], transfer=transfer)
    (finding,) = open_capture(folder).findings

    assert (finding.kind, finding.cameras) == ("hdr-video", ("cam03",))
    assert "videos of cam03 are HDR" in finding.message


def test_videos_that_do_not_state_the_color_matrix_of_others_are_named(folder, shots, pictures):
    for shot, camera_pictures in zip(shots[:2], pictures, strict=False):
        scenes.write_video(folder / f"{shot.name}.mp4", camera_pictures, matrix=Colorspace.ITU709)
    (finding,) = open_capture(folder).findings

    assert (finding.kind, finding.cameras) == ("color-matrices", ("cam03", "cam04"))
    assert "read as BT.601, but others state BT.709" in finding.message


def test_the_color_matrix_of_hdr_videos_is_not_one_that_others_should_state():
    matrices = [UNSTATED_MATRIX, UNSTATED_MATRIX, int(Colorspace.BT2020)]
    names = ["cam00", "cam01", "cam02"]

    assert compare_color_matrices(names, matrices, [False, False, True]) is None
    assert compare_color_matrices(names, matrices, [False, False, False])


@pytest.mark.parametrize("matrix", [Colorspace.ITU709, Colorspace.ITU601])
def test_a_color_matrix_that_all_videos_state_is_no_finding(folder, shots, pictures, matrix):
    for shot, camera_pictures in zip(shots, pictures, strict=True):
        scenes.write_video(folder / f"{shot.name}.mp4", camera_pictures, matrix=matrix)

    assert open_capture(folder).findings == ()


def test_videos_that_do_not_state_bt601_are_no_finding(folder, pictures):
    scenes.write_video(folder / "cam03.mp4", pictures[2], matrix=Colorspace.ITU601)

    assert open_capture(folder).findings == ()


@pytest.mark.parametrize("transfer", [ColorTrc.BT709, ColorTrc.IEC61966_2_1])
def test_videos_in_the_usual_colors_are_no_finding(folder, pictures, transfer):
    scenes.write_video(folder / "cam03.mp4", pictures[2], transfer=transfer)

    assert open_capture(folder).findings == ()
