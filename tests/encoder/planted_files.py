"""Plants faults of real captures in the files of a synthetic capture."""

import shutil

import av
import cv2
import numpy as np
from av.video.reformatter import ColorTrc

from quarc_ref.datasets.points_ply import read_points_ply, write_points_ply
from tests.datasets import forgeries, scenes

CAMERA, OTHER_CAMERA = "cam03", "cam04"


def rewrite_video(folder, edit, **options):
    """Rewrite a camera's video after applying a function to its list of pictures."""
    path = folder / f"{CAMERA}.mp4"
    scenes.write_video(path, edit(scenes.read_video(path)), **options)


def map_levels(edit):
    """Return a function that applies `edit` to the float levels of every picture."""
    return lambda pictures: [
        np.clip(edit(picture.astype(float)), 0, 255).astype(np.uint8) for picture in pictures
    ]


def remove_video(folder):
    (folder / f"{CAMERA}.mp4").unlink()


def remove_poses(folder):
    (folder / "poses_bounds.npy").unlink()


def change_frame_rate(folder):
    rewrite_video(folder, list, rate=25)


def scale_video(folder):
    rewrite_video(
        folder, lambda pictures: [cv2.resize(picture, (240, 180)) for picture in pictures]
    )


def shorten_video(folder):
    rewrite_video(folder, lambda pictures: pictures[:-2])


def truncate_video(folder):
    path = folder / f"{CAMERA}.mp4"
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def add_rotation_flag(folder):
    path = folder / f"{CAMERA}.mp4"
    path.write_bytes(forgeries.show_video(path.read_bytes(), "half a turn"))


def record_in_hdr(folder):
    rewrite_video(folder, list, transfer=ColorTrc.ARIB_STD_B67)


def darken_video(folder):
    rewrite_video(folder, map_levels(lambda picture: 0.5 * picture))


def tint_video(folder):
    rewrite_video(folder, map_levels(lambda picture: picture * (1.25, 1.0, 0.75)))


def interlace_video(folder):
    """Take the odd rows of every picture from a later one, as if motion were fast."""
    rows = np.arange(96)[:, None, None] % 2
    rewrite_video(
        folder,
        lambda pictures: [
            np.where(rows, later, picture)
            for picture, later in zip(pictures, pictures[3:] + pictures[-3:], strict=True)
        ],
    )


def blur_video(folder):
    rewrite_video(folder, map_levels(lambda picture: cv2.GaussianBlur(picture, (0, 0), 1.5)))


def delay_video(folder):
    """Remove the first three frames, so that all later frames are three frames early."""
    rewrite_video(folder, lambda pictures: pictures[3:])


def freeze_video(folder):
    rewrite_video(folder, lambda pictures: [pictures[0]] * len(pictures))


def push_camera(folder):
    """Shift all pictures from frame 7 on by three pixels."""
    rewrite_video(
        folder,
        lambda pictures: [
            np.roll(picture, 3, axis=1) if frame >= 7 else picture
            for frame, picture in enumerate(pictures)
        ],
    )


def cover_camera(folder):
    """Make all pictures from frame 7 on dark gray."""
    rewrite_video(
        folder,
        lambda pictures: [
            np.full_like(picture, 20) if frame >= 7 else picture
            for frame, picture in enumerate(pictures)
        ],
    )


def begin_with_black(folder, name=CAMERA, count=1):
    """Make the first pictures of a camera black, as some cameras and editing programs do."""
    path = folder / f"{name}.mp4"
    pictures = scenes.read_video(path)
    scenes.write_video(path, [np.zeros_like(pictures[0])] * count + pictures[count:])


def repeat_frames(folder):
    rewrite_video(
        folder, lambda pictures: [pictures[i - (i % 3 == 2)] for i in range(len(pictures))]
    )


def damage_frame(folder):
    path = folder / f"{CAMERA}.mp4"
    with av.open(str(path)) as container:
        packets = [(p.pos, p.size) for p in container.demux(video=0) if p.size]
    position, size = packets[5]
    data = bytearray(path.read_bytes())
    data[position + 8 : position + size] = bytes(size - 8)
    path.write_bytes(data)


def swap_videos(folder):
    first, second = (folder / f"{name}.mp4" for name in (CAMERA, OTHER_CAMERA))
    first.rename(folder / "x.mp4")
    second.rename(first)
    (folder / "x.mp4").rename(second)


def duplicate_video(folder):
    shutil.copy(folder / f"{CAMERA}.mp4", folder / f"{OTHER_CAMERA}.mp4")


def rotate_pose(folder, degrees=(0.0, 1.0, 0.0)):
    """Rotate a camera around its down, right and backward axes."""
    rows = np.load(folder / "poses_bounds.npy")
    index = int(CAMERA[3:])
    matrix = rows[index, :15].reshape(3, 5)
    rotation = cv2.Rodrigues(np.radians(degrees))[0]
    matrix[:, :3] = matrix[:, :3] @ rotation
    np.save(folder / "poses_bounds.npy", rows)


def roll_pose(folder):
    """Rotate a camera around its optical axis, by too little for colors to reveal it."""
    rotate_pose(folder, (0.0, 0.0, 5.0))


def move_points(folder):
    path = folder / "points3D_init.ply"
    points = read_points_ply(path)
    points.positions[::2] += np.float32([0.0, 0.0, 90.0])
    write_points_ply(path, points)


# For each fault, the kind of the finding and the cameras that it names.
FAULTS = {
    remove_video: ("count-mismatch", ()),
    remove_poses: ("unknown-layout", ()),
    change_frame_rate: ("frame-rate", ()),
    scale_video: ("unreadable-pose", ()),
    shorten_video: ("uneven-lengths", (CAMERA,)),
    truncate_video: ("truncated-video", ()),
    add_rotation_flag: ("rotation-flags", (CAMERA,)),
    record_in_hdr: ("hdr-video", (CAMERA,)),
    darken_video: ("exposure-differs", (CAMERA,)),
    tint_video: ("colors-differ", (CAMERA,)),
    interlace_video: ("interlaced-video", (CAMERA,)),
    blur_video: ("blurred", (CAMERA,)),
    delay_video: ("out-of-sync", (CAMERA,)),
    freeze_video: ("frozen-camera", (CAMERA,)),
    repeat_frames: ("repeated-frames", (CAMERA,)),
    push_camera: ("camera-moved", (CAMERA,)),
    cover_camera: ("camera-covered", (CAMERA,)),
    damage_frame: ("unreadable-frame", (CAMERA,)),
    swap_videos: ("poses-mixed-up", (CAMERA, OTHER_CAMERA)),
    duplicate_video: ("same-pictures", (CAMERA, OTHER_CAMERA)),
    rotate_pose: ("pose-disagrees", (CAMERA,)),
    roll_pose: ("epipolar-error", (CAMERA,)),
    move_points: ("points-outside-views", ()),
}
