"""Renders the frames of a stream for given cameras, as pictures or depth.

`eval` uses the same renderer, so pictures have the quality that `eval` reports, except for
rounding to 8 bits.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

import numpy as np

from quarc_ref.datasets.capture import Image
from quarc_ref.decoder import Splats
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.magnification import Magnification, measure_magnification
from quarc_ref.rendering.pictures import render_bands
from quarc_ref.rendering.pipeline_data import Float32, Picture
from quarc_ref.streams import Source, decode
from quarc_ref.viewing.between_frames import FramesInOrder
from quarc_ref.viewing.paths.pose import PlannedPicture

Rendering = TypeVar("Rendering")
Color = tuple[float, float, float]
BLACK: Color = (0.0, 0.0, 0.0)


def draw_planned_pictures(
    source: Source,
    planned_pictures: Sequence[PlannedPicture],
    draw: Callable[[Splats, Camera, Magnification], Rendering],
    capture_cameras: Sequence[Camera],
    stop: int | None = None,
) -> Iterator[Rendering]:
    """Render planned pictures, some of which may be between two frames (`between_frames`).

    Args:
        source: A stream with the frames of all planned pictures.
        planned_pictures: Pictures to render, in playback order; at least one.
        draw: Function that renders a frame for a camera at a magnification.
        capture_cameras: Cameras of the stream, to which magnifications are relative.
        stop: Ordinal after the last frame to decode; it may be after the frame of the last
            planned picture. None to decode to the end of the stream.

    Yields:
        The result of `draw` for each planned picture.

    Raises:
        BitstreamError: The stream is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    scenes = decode(source, planned_pictures[0].frame, stop)
    frames = FramesInOrder(scenes)
    for planned in planned_pictures:
        splats = frames.find(planned.frame, planned.share)
        magnification = measure_magnification(planned.camera, capture_cameras)
        yield draw(splats, planned.camera, magnification)
    deque(scenes, maxlen=0)  # damage in later frames is reported


def draw_picture(
    splats: Splats,
    camera: Camera,
    magnification: Magnification,
    background: Color | None = BLACK,
) -> Image:
    """Render an sRGB picture in bands, to save memory.

    Args:
        splats: Splats of a frame.
        camera: The camera.
        magnification: Size of the picture relative to the capture.
        background: Color of the background, 0 to 1; None for a transparent one.

    Returns:
        `[H, W, 3]` picture; with a transparent background, `[H, W, 4]` with alpha, by which colors
        are not multiplied.
    """
    picture = np.empty((camera.height, camera.width, 3 if background else 4), dtype=np.uint8)
    for band in render_bands(splats, camera, magnification):
        rows = _add_background(band, background)
        np.clip(rows, 0, 1, out=rows)
        rows *= 255
        rows += np.float32(0.5)
        picture[band.top : band.top + rows.shape[0]] = rows.astype(np.uint8)
    return picture


def _add_background(band: Picture, background: Color | None) -> Float32:
    """Return the rows `[h, W, 3]` of a band on a color, or `[h, W, 4]` with alpha."""
    transmittance = np.abs(band.transmittance)[..., None]
    if background is None:
        alpha = 1 - transmittance
        colors = np.divide(band.image, alpha, out=np.zeros_like(band.image), where=alpha > 0)
        return np.concatenate([colors, alpha], axis=2)
    if background != BLACK:
        band.image[:] += transmittance * np.array(background, dtype=np.float32)
    return band.image
