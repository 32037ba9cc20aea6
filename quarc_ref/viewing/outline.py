"""Finds the cameras and frames of a stream without decoding it.

Only the chunk headers of frames are read, not their payloads.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction

from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.container import ChunkHeader
from quarc_ref.format.errors import BitstreamError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.frame_walk import FrameWalk
from quarc_ref.streams.source import Source


class CameraChoiceError(ValueError):
    """The stream does not have the requested camera."""


@dataclass(frozen=True, slots=True)
class Outline:
    """The structure of a stream, read from its chunk headers.

    Attributes:
        header: Header from the HEAD chunk.
        cameras: Cameras from the last `came` chunk.
        metadata: Metadata from the last `meta` chunk.
        first_frame: Ordinal of the first frame.
        chunk_headers: Chunk headers of the frames in order, up to the first damaged chunk.
    """

    header: StreamHeader
    cameras: tuple[Camera, ...]
    metadata: dict[str, str]
    first_frame: int
    chunk_headers: tuple[ChunkHeader, ...]

    @property
    def stop(self) -> int:
        """Ordinal after the last frame."""
        return self.first_frame + len(self.chunk_headers)

    def count_frames(self, start: int, stop: int | None) -> int:
        """Return the number of frames in the stream from `start` to `stop` - 1."""
        end = self.stop if stop is None else min(stop, self.stop)
        return max(0, end - max(start, self.first_frame))


def outline_stream(source: Source) -> Outline:
    """Read the outline of a stream.

    Raises:
        BitstreamError: HEAD is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    frame_walk = FrameWalk(source)
    cameras: tuple[Camera, ...] = ()
    metadata: dict[str, str] = {}
    chunk_headers: list[ChunkHeader] = []
    first_frame = 0
    with suppress(BitstreamError):  # decoding reports the error
        for step in frame_walk:
            if step.header.kind == container.CAME:
                cameras = wire.parse_cameras(frame_walk.take(step).payload)
            elif step.header.kind == container.META:
                metadata = wire.parse_metadata(frame_walk.take(step).payload)
            if step.is_frame and step.frame is not None:
                first_frame = first_frame if chunk_headers else step.frame
                chunk_headers.append(step.header)
    if chunk_headers and chunk_headers[-1].end > frame_walk.offset:
        chunk_headers.pop()  # the stream ends inside its last frame
    return Outline(
        wire.parse_stream_header(frame_walk.head),
        cameras,
        metadata,
        first_frame if chunk_headers else 0,
        tuple(chunk_headers),
    )


def read_cameras(source: Source) -> tuple[Camera, ...] | None:
    """Return the cameras before the first frame of a stream; None if the stream has no frames.

    Only the bytes before the first frame are read.

    Raises:
        BitstreamError: The beginning of the stream is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    frame_walk = FrameWalk(source)
    cameras: tuple[Camera, ...] = ()
    for step in frame_walk:
        if step.is_frame:
            return cameras
        if step.header.kind == container.CAME:
            cameras = wire.parse_cameras(frame_walk.take(step).payload)
    return None


def find_camera(cameras: Sequence[Camera], name: str | None) -> Camera:
    """Return a camera by its name; None selects the first camera.

    Raises:
        CameraChoiceError: The stream has no such camera; the message lists its cameras.
    """
    if not cameras:
        message = "the stream has no cameras"
        raise CameraChoiceError(message)
    for camera in cameras:
        if name in (None, camera.name):
            return camera
    names = ", ".join(camera.name for camera in cameras)
    message = f"the stream has no camera {name}; its cameras are {names}"
    raise CameraChoiceError(message)


def compute_scaled_height(camera: Camera, width: int) -> int:
    """Return the height of a camera's pictures after they are scaled to a width.

    Args:
        camera: The camera.
        width: Width in pixels; may be arbitrarily large.
    """
    return max(1, round(Fraction(camera.height * width, camera.width)))


def resize_camera(camera: Camera, width: int) -> Camera:
    """Return a camera whose pictures are scaled to a width."""
    height = compute_scaled_height(camera, width)
    scale_x, scale_y = width / camera.width, height / camera.height
    return replace(
        camera,
        width=width,
        height=height,
        fx=camera.fx * scale_x,
        cx=camera.cx * scale_x,
        fy=camera.fy * scale_y,
        cy=camera.cy * scale_y,
    )
