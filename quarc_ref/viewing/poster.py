"""Renders the poster of a page: the first frame of a stream, seen from a camera."""

from quarc_ref.datasets.video_writer import build_jpeg
from quarc_ref.decoder import dequantize
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.magnification import measure_magnification
from quarc_ref.streams import Source, decode
from quarc_ref.viewing.draw_frames import draw_picture
from quarc_ref.viewing.outline import compute_scaled_height, resize_camera

_MAX_SIDE = 960  # pixels


def draw_poster(source: Source, camera: Camera) -> bytes | None:
    """Render the first frame as a JPEG file of at most 960 x 960 pixels.

    Args:
        source: A stream.
        camera: Camera of the stream.

    Returns:
        Bytes of the file; None if the camera's pictures are too narrow for a poster.

    Raises:
        BitstreamError: The stream is invalid at or before its first frame.
    """
    width = min(camera.width, _MAX_SIDE, max(1, camera.width * _MAX_SIDE // camera.height))
    if compute_scaled_height(camera, width) > _MAX_SIDE:
        return None
    resized_camera = resize_camera(camera, width)
    magnification = measure_magnification(resized_camera, [camera])
    splats = dequantize(next(decode(source)))
    return build_jpeg(draw_picture(splats, resized_camera, magnification))
