"""Renders the poster of a page: the first frame of a stream in the view of a camera."""

from quarc_ref.datasets.video_writer import build_jpeg
from quarc_ref.format.cameras import Camera
from quarc_ref.streams import Source
from quarc_ref.viewing.draw_frames import draw_frames
from quarc_ref.viewing.outline import fit_height, resize_camera

_SIDE = 960  # pixels


def draw_poster(source: Source, camera: Camera) -> bytes | None:
    """Render the first frame as a JPEG file of at most 960 x 960 pixels.

    Args:
        source: A stream.
        camera: Camera of the stream.

    Returns:
        Bytes of the file; None if the camera's pictures are too narrow for a poster.

    Raises:
        BitstreamError: The stream is invalid before or at its first frame.
    """
    width = min(camera.width, _SIDE, max(1, camera.width * _SIDE // camera.height))
    if fit_height(camera, width) > _SIDE:
        return None
    _, picture = next(draw_frames(source, resize_camera(camera, width)))
    return build_jpeg(picture)
