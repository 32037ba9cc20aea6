"""Decodes a stream, edits all frames, and encodes them again with bounded errors."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain
from typing import BinaryIO

from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.encoder.scenes.edits import Edit, edit_frames
from quarc_ref.encoder.scenes.encode_scenes import (
    GivenFrame,
    SceneOptions,
    SceneReport,
    encode_scenes,
)
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import EncodeError
from quarc_ref.streams.decode_stream import decode
from quarc_ref.streams.source import Source


def encode_edited(source: Source, sink: BinaryIO, edit: Edit, options: SceneOptions) -> SceneReport:
    """Write an edited stream. If only colors change, `recolor` is faster and exact.

    Frame numbers, frame rate, axes, scale, anchors, cameras and metadata are taken from the input
    stream; axes, up direction, scale and cameras are transformed with the scene. Cameras and
    metadata may change during the stream; what follows the last frame is not copied.

    Args:
        source: The input stream.
        sink: Binary file to which the edited stream is appended.
        edit: The edit to apply to every frame.
        options: Options; the fields that the input stream provides are ignored.

    Raises:
        BitstreamError: The input stream is invalid.
        EncodeError: The edit removes all Gaussians of a frame, the scale of the edited stream is
            out of the format's range, or a frame cannot be coded within the bounds.
    """
    decoder = StreamDecoder()
    scenes: Iterator[Scene] = decode(source, decoder=decoder)
    first_scene = next(scenes, None)
    if first_scene is None:
        message = "the stream has no frames"
        raise EncodeError(message)
    cameras, metadata = _edit_side_data(decoder, edit)
    header = replace(decoder.header, rotation_components=3, snapshots=False)
    if edit.similarity:
        header = edit.similarity.apply_to_header(header)
    options = replace(
        options,
        frames_per_second=header.frames_per_second,
        cameras=cameras,
        metadata=metadata,
        header=header,
        first_frame=first_scene.frame,
    )
    frames = edit_frames(chain([first_scene], scenes), edit)
    return encode_scenes(_add_side_data(frames, decoder, edit), sink, options)


def _add_side_data(
    frames: Iterable[GivenFrame], decoder: StreamDecoder, edit: Edit
) -> Iterator[GivenFrame]:
    """Yield frames with the cameras and the metadata that the decoder has when it decodes them."""
    for frame in frames:
        cameras, metadata = _edit_side_data(decoder, edit)
        yield replace(frame, cameras=cameras, metadata=metadata)


def _edit_side_data(
    decoder: StreamDecoder, edit: Edit
) -> tuple[tuple[Camera, ...], dict[str, str]]:
    """Return the edited cameras and metadata of the frame that was decoded last."""
    if edit.similarity is None:
        return decoder.cameras, decoder.metadata
    cameras = tuple(map(edit.similarity.apply_to_camera, decoder.cameras))
    return cameras, edit.similarity.apply_to_metadata(decoder.metadata, decoder.header)
