"""Finds interlaced videos, whose even and odd rows show different times.

Where something moves, each row then differs more from its neighbors than from the rows of its own
field, which are two rows away. Flags in the file are not used: they are also set for progressive
video in an interlaced format, and are lost if interlaced video is recoded as progressive.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from quarc_ref.datasets.capture import Capture, Image, PictureSource
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.findings import Finding, format_names

_PAIR_COUNT = 6  # pairs of consecutive frames, spread over the recording
_MOTION_BLUR_PIXELS = 5
_MIN_MOTION = 16.0  # mean change of moving pixels, 0 to 255
_MIN_MOVING_PIXELS = 500
# In the captures of `synth`, the ratio is at most 0.6 for progressive and at least 1.4 for
# interlaced pictures that move enough. Of noise alone, it is 1.
_MIN_RATIO = 1.2


def find_interlaced_videos(capture: Capture) -> Iterator[Finding]:
    """Yield a finding that lists the cameras whose pictures are interlaced."""
    pictures, last = capture.stored_pictures, capture.frame_count - 1
    if pictures is None or last < 1:  # a single frame shows no motion
        return
    frames = sorted({int(frame) for frame in np.linspace(0, last - 1, _PAIR_COUNT)})
    names = tuple(
        camera.name
        for index, camera in enumerate(capture.cameras)
        if _is_interlaced(
            pictures,
            index,
            [t for t in frames if capture.is_used(index, t) and capture.is_used(index, t + 1)],
        )
    )
    if names:
        message = (
            f"the pictures of {format_names(names)} are interlaced: even and odd rows show "
            "different times, so everything that moves has combs. Deinterlace the videos of all "
            "cameras in the same way (ffmpeg -i OLD.mp4 -vf bwdif=mode=send_frame NEW.mp4), or "
            "record progressive video"
        )
        yield Finding("interlaced-video", message, names)


def _is_interlaced(pictures: PictureSource, camera: int, frames: list[int]) -> bool:
    sums = np.zeros(3)
    for frame in frames:
        try:
            sums += measure_combs(pictures.read(camera, frame), pictures.read(camera, frame + 1))
        except CaptureError:  # another check reports unreadable frames
            continue
    neighbor_difference, field_difference, pixel_count = sums
    return bool(
        pixel_count >= _MIN_MOVING_PIXELS and neighbor_difference > _MIN_RATIO * field_difference
    )


def measure_combs(picture: Image, next_picture: Image) -> NDArray[np.float64]:
    """Return three sums over the moving pixels of a picture.

    They are the difference from the mean of both neighboring rows, the difference from the mean of
    both neighboring rows of the same field, and the number of pixels.
    """
    green, next_green = (image[..., 1].astype(np.float32) for image in (picture, next_picture))
    motion = uniform_filter(np.abs(green - next_green), _MOTION_BLUR_PIXELS)
    is_moving = motion[2:-2] > _MIN_MOTION
    rows = green[2:-2]
    differences = [
        np.abs(rows - (above + below) / 2)[is_moving].sum()
        for above, below in ((green[1:-3], green[3:-1]), (green[:-4], green[4:]))
    ]
    return np.array([*differences, is_moving.sum()], dtype=np.float64)
