"""Reads the chunks before a stream's first frame, for readers that start at a later frame."""

from quarc_ref.format import container, wire
from quarc_ref.format.cameras import Camera
from quarc_ref.streams.frame_walk import FrameWalk
from quarc_ref.streams.source import Source


def read_prologue(source: Source) -> tuple[tuple[Camera, ...], dict[str, str]]:
    """Read the cameras and the metadata before the first frame of a stream.

    Args:
        source: A stream, which is read up to its first frame.

    Raises:
        BitstreamError: A chunk up to the first frame is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    walk = FrameWalk(source)
    cameras: tuple[Camera, ...] = ()
    metadata: dict[str, str] = {}
    for step in walk:
        if step.is_frame:
            break
        if step.header.kind == container.CAME:
            cameras = wire.parse_cameras(walk.take(step).payload)
        elif step.header.kind == container.META:
            metadata = wire.parse_metadata(walk.take(step).payload)
    return cameras, metadata
