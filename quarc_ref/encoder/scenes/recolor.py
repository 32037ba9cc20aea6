"""Recolors a stream exactly: all coded integers stay, except the codes of SH DC.

A color is 0.5 + C0 s, where s are the coefficients (SPEC 10.2). A common gain scales the
steps of SH and adds a number to the codes of SH DC; an offset of a channel also adds to
these codes. Positions, anchors and decoder decisions do not depend on these codes, so the
symbols of motion, updates and deaths stay the same.
"""

from dataclasses import dataclass, replace
from typing import BinaryIO

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.frames import read_checked, read_checked_snapshot
from quarc_ref.decoder.state import Reference
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.export.activate import SH_BASE
from quarc_ref.format import container, wire
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import EncodeError, StateError
from quarc_ref.format.records import SH_DC, Births, Gaussians, StreamHeader
from quarc_ref.format.updates import Updates
from quarc_ref.streams.decode_stream import walk_frames
from quarc_ref.streams.source import Source


@dataclass(frozen=True, slots=True)
class Recoloring:
    """A change of all colors of a scene.

    Attributes:
        gain: Factor of all colors, above 0.
        offset: Offset added to red, green and blue afterwards; 1 is white.
    """

    gain: float = 1.0
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def apply(self, splats: Splats) -> Splats:
        """Return a scene with the new colors."""
        sh = splats.sh * np.float32(self.gain)
        sh[:, 0] += ((self.gain - 1) / 2 + np.array(self.offset, np.float32)) / np.float32(SH_BASE)
        return replace(splats, sh=sh)

    def change_header(self, header: StreamHeader) -> StreamHeader:
        """Return the header with the SH steps that apply the gain.

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
            message = f"a gain of {self.gain}: {error}"
            raise EncodeError(message) from error

    def count_codes(self, header: StreamHeader) -> Int64:
        """Return the `[3]` offsets of the codes of SH DC, for a header with the new steps.

        Raises:
            EncodeError: An offset exceeds the range of the codes.
        """
        shift = (self.gain - 1) / 2 + np.array(self.offset)
        codes = np.rint(shift / (SH_BASE * header.sh_dc_step))
        if np.abs(codes).max() > 2 * CODE_LIMIT:
            message = (
                f"a gain of {self.gain} and offsets of {self.offset} exceed the range of the codes"
            )
            raise EncodeError(message)
        rounded: Int64 = codes.astype(np.int64)
        return rounded


def recolor(source: Source, sink: BinaryIO, recoloring: Recoloring) -> int:
    """Write a stream with new colors; return its number of frames.

    Offsets are rounded to whole codes; everything else is exact. Cameras and metadata are
    kept. Snapshots become canonical frames with the same state, and ancillary chunks of
    unknown types are dropped.

    Args:
        source: A stream.
        sink: Binary file to which the stream is appended.
        recoloring: The new colors.

    Raises:
        BitstreamError: The stream is invalid.
        EncodeError: A color is out of the format's range.
    """
    decoder = StreamDecoder()
    writer: _Recoloring | None = None
    for chunk, state in walk_frames(source, decoder):
        writer = writer or _Recoloring(decoder, sink, recoloring)
        if chunk.kind in container.CANONICAL_TYPES:
            writer.add_canonical(chunk, state.frame)
        else:
            writer.add_frame(chunk, state.symbols, state.updates, state.births)
    if writer is None:
        message = "the stream has no frame"
        raise EncodeError(message)
    return writer.finish()


class _Recoloring:
    """A stream that is being recolored.

    Args:
        decoder: Decoder of the input stream, at its first frame.
        sink: Binary file to which the stream is appended.
        recoloring: The new colors.
    """

    def __init__(self, decoder: StreamDecoder, sink: BinaryIO, recoloring: Recoloring) -> None:
        self._old = decoder.header
        self._new = recoloring.change_header(self._old)
        self._codes = recoloring.count_codes(self._new)
        self._decoder = decoder
        self._loop = ClosedLoop(sink, self._new, decoder.cameras, decoder.metadata)
        self._count = 0

    def add_canonical(self, chunk: Chunk, frame: int) -> None:
        """Write a canonical frame, or a snapshot as one."""
        if chunk.kind == container.CANO:
            gaussians = read_checked(self._old, wire.parse_canonical(chunk.payload))
        else:
            parsed = wire.parse_snapshot(chunk.payload)
            reference = self._decoder.reference
            gaussians = read_checked_snapshot(
                self._old, parsed, _known(reference).gaussians
            ).gaussians
        try:
            self._loop.commit_canonical(self._shift(gaussians), frame)
        except StateError as error:
            raise EncodeError(str(error)) from error
        self._count += 1

    def add_frame(
        self,
        chunk: Chunk,
        symbols: tuple[Int64, ...],
        updates: Updates | None,
        births: Births | None,
    ) -> None:
        """Write a frame with the same motion, updates and deaths."""
        parsed = wire.parse_frame(chunk.payload, updates=self._old.updates)
        start = self._loop.start_frame(parsed.death_count)
        moved = self._loop.move_frame(start, list(symbols), updates)
        if births is not None and births.newborn.count:
            births = Births(births.parents, self._shift(births.newborn))
        else:
            births = None
        self._loop.commit_frame(moved, births)
        self._count += 1

    def finish(self) -> int:
        """Write the end of the stream; return the number of frames."""
        self._loop.finish()
        return self._count

    def _shift(self, gaussians: Gaussians) -> Gaussians:
        codes = gaussians.codes.copy()
        codes[SH_DC] += self._codes[:, None]
        return replace(gaussians, codes=codes)


def _known(reference: Reference | None) -> Reference:
    if reference is None:  # the decoder has rejected such a snapshot
        message = "a snapshot without a canonical frame"
        raise EncodeError(message)
    return reference
