"""Recolors a stream without refitting it: only the SH steps and the SH DC codes change.

A color is 0.5 + C0 s, where s is an SH DC coefficient (SPEC 10.2). A gain scales the
quantization steps of SH and adds a constant to the codes of SH DC. A color offset also adds a
constant to the codes of SH DC. Positions and anchors do not depend on the codes of SH DC, so the
symbols of motion, updates and deaths stay the same.
"""

from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.frames import read_checked_canonical, read_checked_snapshot
from quarc_ref.decoder.state import SnapshotReference
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT, SH_C0
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import EncodeError, StateError
from quarc_ref.format.records import SH_DC, Births, Gaussians, StreamHeader
from quarc_ref.format.updates import Updates
from quarc_ref.streams.decode_stream import walk_frames
from quarc_ref.streams.source import Source


@dataclass(frozen=True, slots=True)
class Recoloring:
    """A change of all colors of a scene: `color` becomes `gain * color + offset`.

    Attributes:
        gain: Factor by which all colors are multiplied, above 0.
        offset: Offset of each color channel; 1 is the difference between black and white.
    """

    gain: float = 1.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def apply(self, splats: Splats) -> Splats:
        """Return the Gaussians with changed colors."""
        sh = splats.sh * np.float32(self.gain)
        sh[:, 0] += ((self.gain - 1) / 2 + np.array(self.offset, np.float32)) / np.float32(SH_C0)
        return replace(splats, sh=sh)

    def change_header(self, header: StreamHeader) -> StreamHeader:
        """Return the header with SH steps multiplied by the gain.

        Raises:
            EncodeError: The steps are out of the header's range.
        """
        try:
            return replace(
                header,
                sh_dc_step=float(np.float32(header.sh_dc_step * self.gain)),
                sh_rest_step=float(np.float32(header.sh_rest_step * self.gain)),
            )
        except ValueError as error:
            message = f"the gain {self.gain} cannot be applied to the SH steps: {error}"
            raise EncodeError(message) from error

    def compute_code_offsets(self, header: StreamHeader) -> Int64:
        """Return the `[3]` integers to add to the codes of SH DC.

        Args:
            header: Header that `change_header` returned.

        Raises:
            EncodeError: An offset exceeds the range of the codes.
        """
        color_offset = (self.gain - 1) / 2 + np.array(self.offset)
        rounded_offsets = np.rint(color_offset / (SH_C0 * header.sh_dc_step))
        if np.abs(rounded_offsets).max() > 2 * CODE_LIMIT:
            message = (
                f"the gain {self.gain} with the offsets {self.offset} exceeds the range of SH DC "
                "codes: use smaller changes"
            )
            raise EncodeError(message)
        code_offsets: Int64 = rounded_offsets.astype(np.int64)
        return code_offsets


def recolor(source: Source, sink: BinaryIO, recoloring: Recoloring) -> int:
    """Write a stream with new colors; return its number of frames.

    Color offsets are rounded to whole codes; all other values are exact. Cameras and metadata
    are copied, wherever in the stream they change. Snapshots become canonical frames with the
    same state. Ancillary chunks of unknown types are dropped.

    Args:
        source: The input stream.
        sink: Binary file to which the recolored stream is appended.
        recoloring: The change of the colors.

    Raises:
        BitstreamError: The input stream is invalid.
        EncodeError: A color is out of the format's range.
    """
    decoder = StreamDecoder()
    writer: _RecoloringWriter | None = None
    for chunk, state in walk_frames(source, decoder):
        writer = writer or _RecoloringWriter(decoder, sink, recoloring)
        writer.copy_side_data()
        if chunk.kind in container.CANONICAL_TYPES:
            writer.add_canonical(chunk, state.frame)
        else:
            writer.add_frame(chunk, state.symbols, state.updates, state.births)
    if writer is None:
        message = "the stream has no frames"
        raise EncodeError(message)
    return writer.finish()


class _RecoloringWriter:
    """Writes the recolored frames of a stream.

    Args:
        decoder: Decoder of the input stream, which has decoded the first frame.
        sink: Binary file to which the recolored stream is appended.
        recoloring: The change of the colors.
    """

    def __init__(self, decoder: StreamDecoder, sink: BinaryIO, recoloring: Recoloring) -> None:
        self._input_header = decoder.header
        self._output_header = recoloring.change_header(self._input_header)
        self._code_offsets = recoloring.compute_code_offsets(self._output_header)
        self._decoder = decoder
        self._cameras, self._metadata = decoder.cameras, decoder.metadata
        self._loop = ClosedLoop(sink, self._output_header, self._cameras, self._metadata)
        self._frame_count = 0

    def copy_side_data(self) -> None:
        """Write the cameras and the metadata of the input again if they have changed."""
        if self._decoder.cameras != self._cameras:
            self._cameras = self._decoder.cameras
            self._loop.write_cameras(self._cameras)
        if self._decoder.metadata != self._metadata:
            self._metadata = self._decoder.metadata
            self._loop.write_metadata(self._metadata)

    def add_canonical(self, chunk: Chunk, frame: int) -> None:
        """Write a canonical frame or a snapshot of the input as a canonical frame."""
        origin = None
        if chunk.kind == container.CANO:
            canonical = wire.parse_canonical(chunk.payload)
            gaussians = read_checked_canonical(self._input_header, canonical)
            origin = np.array(canonical.origin)  # the order of the Gaussians depends on it
        else:
            snapshot = wire.parse_snapshot(chunk.payload)
            reference = self._decoder.reference
            gaussians = read_checked_snapshot(
                self._input_header, snapshot, _require_reference(reference).gaussians
            ).gaussians
        try:
            self._loop.commit_canonical(self._shift_colors(gaussians), frame, origin)
        except StateError as error:
            raise EncodeError(str(error)) from error
        self._frame_count += 1

    def add_frame(
        self,
        chunk: Chunk,
        symbols: tuple[Int64, ...],
        updates: Updates | None,
        births: Births | None,
    ) -> None:
        """Write a FRAM chunk with unchanged motion, updates and deaths, and recolored births."""
        frame = wire.parse_frame(chunk.payload, updates=self._input_header.updates)
        start = self._loop.start_frame(frame.death_count)
        moved_frame = self._loop.move_frame(start, list(symbols), updates)
        if births is not None and births.newborn.count:
            births = Births(births.parents, self._shift_colors(births.newborn))
        else:
            births = None
        self._loop.commit_frame(moved_frame, births)
        self._frame_count += 1

    def finish(self) -> int:
        """Write what follows the last frame; return the number of frames."""
        self.copy_side_data()
        self._loop.finish()
        return self._frame_count

    def _shift_colors(self, gaussians: Gaussians) -> Gaussians:
        codes = gaussians.codes.copy()
        codes[SH_DC] += self._code_offsets[:, None]
        return replace(gaussians, codes=codes)


def _require_reference(reference: SnapshotReference | None) -> SnapshotReference:
    if reference is None:  # cannot happen: the decoder rejects such a stream
        message = "the stream has a snapshot without a canonical frame before it"
        raise EncodeError(message)
    return reference
