"""Interlaced videos are found by their combs, whether or not the files say that they are."""

import av
import numpy as np
import pytest

from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.checks.interlacing import find_interlaced_videos
from tests.datasets import scenes

FRAMES = 12
SHOTS = scenes.make_shots(size=(96, 64), focal=80.0)
CAMERA = SHOTS[1].name


@pytest.fixture(scope="module")
def pictures():
    """Pictures of `CAMERA`, in which a disc moves by several pixels per frame."""
    return [scenes.render(SHOTS[1], 2.0 * frame - FRAMES) for frame in range(FRAMES)]


@pytest.fixture
def folder(tmp_path):
    return scenes.write_n3dv(tmp_path / "plane", SHOTS, points=scenes.make_plane_points())


def weave(pictures):
    """Return pictures with the even rows of a picture and the odd rows of the next one."""
    woven = [picture.copy() for picture in pictures[::2]]
    for picture, later in zip(woven, pictures[1::2], strict=True):
        picture[1::2] = later[1::2]
    return woven


def write_camera(folder, pictures, *, has_flag):
    with av.open(str(folder / f"{CAMERA}.mp4"), "w") as container:
        options = {"crf": "18", **({"x264-params": "tff=1"} if has_flag else {})}
        stream = container.add_stream("libx264", rate=30, options=options)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
    with av.open(str(folder / f"{CAMERA}.mp4")) as container:
        assert all(frame.interlaced_frame == has_flag for frame in container.decode(video=0))


def find(folder, **options):
    return list(find_interlaced_videos(open_capture(folder, CaptureOptions(**options))))


@pytest.mark.parametrize("downscale", [1, 2])
@pytest.mark.parametrize("has_flag", [False, True])
def test_interlaced_videos_are_named(folder, pictures, has_flag, downscale):
    write_camera(folder, weave(pictures), has_flag=has_flag)
    (finding,) = find(folder, downscale=downscale)

    assert (finding.kind, finding.cameras) == ("interlaced-video", (CAMERA,))
    assert f"pictures of {CAMERA} are interlaced" in finding.message


@pytest.mark.parametrize("noise", [0, 6, 40])
@pytest.mark.parametrize("has_flag", [False, True])
def test_progressive_videos_are_no_finding(folder, pictures, has_flag, noise):
    random = np.random.default_rng(5)
    noisy_pictures = [
        np.clip(picture + random.normal(0, noise, picture.shape), 0, 255).astype(np.uint8)
        for picture in pictures
    ]
    write_camera(folder, noisy_pictures, has_flag=has_flag)

    assert find(folder) == []


def test_fine_rows_that_do_not_move_are_no_finding(folder, pictures):
    striped_pictures = [picture // 2 for picture in pictures]
    for picture in striped_pictures:
        picture[: picture.shape[0] // 5 : 2] += 100
    write_camera(folder, striped_pictures, has_flag=False)

    assert find(folder) == []


@pytest.mark.parametrize("frames", [1, 2])
def test_few_frames_can_be_examined(folder, frames):
    assert find(folder, max_frames=frames) == []


def test_a_single_frame_is_not_checked(tmp_path):
    shots = SHOTS[:3]
    folder = scenes.write_n3dv(tmp_path / "still", shots, points=scenes.make_plane_points())
    for shot in shots:
        (folder / f"{shot.name}.mp4").unlink()
        scenes.write_picture(folder / shot.name / "0000.png", scenes.render(shot, 0.0))

    assert find(folder) == []
