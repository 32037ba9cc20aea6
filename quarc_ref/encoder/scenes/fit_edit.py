"""Edits the frames of a stream and fits them again, as in `import`."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import BinaryIO

from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.encoder.scenes.edits import Edit, edit_frames
from quarc_ref.encoder.scenes.encode_scenes import SceneOptions, SceneReport, encode_scenes
from quarc_ref.format.errors import EncodeError
from quarc_ref.streams.decode_stream import decode
from quarc_ref.streams.source import Source


def encode_edited(source: Source, sink: BinaryIO, edit: Edit, options: SceneOptions) -> SceneReport:
    """Write an edited stream; use `recolor` for pure color changes.

    Frame rate, axes, scale, anchors, cameras and metadata are taken from the stream, and
    transformed if necessary.

    Args:
        source: A stream.
        sink: Binary file to which the stream is appended.
        edit: The edit of every frame.
        options: Bounds and progress; other options are taken from the stream.

    Raises:
        BitstreamError: The stream is invalid.
        EncodeError: A frame has no Gaussian left, or cannot be coded within the bounds.
    """
    decoder = StreamDecoder()
    scenes: Iterator[Scene] = decode(source, decoder=decoder)
    first = next(scenes, None)
    if first is None:
        message = "the stream has no frame"
        raise EncodeError(message)
    header, cameras = decoder.header, decoder.cameras
    header = replace(header, rotation_components=3, snapshots=False)
    if edit.similarity:
        header = edit.similarity.apply_to_header(header)
        cameras = tuple(map(edit.similarity.apply_to_camera, cameras))
    options = replace(
        options,
        frames_per_second=header.frames_per_second,
        cameras=cameras,
        metadata=decoder.metadata,
        header=header,
    )
    return encode_scenes(edit_frames(chain([first], scenes), edit), sink, options)
