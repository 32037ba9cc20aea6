"""Decodes damaged streams: SPEC 11.4.

Nothing is lost silently: every byte is either in a decoded chunk or in a reported gap.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import container, wire
from quarc_ref.format.constants import TAIL_BYTES
from quarc_ref.format.container import Chunk, ChunkHeader
from quarc_ref.format.errors import (
    BitstreamError,
    PayloadCrcError,
    TruncatedError,
    UnknownCriticalError,
)
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.follow import Follow, poll
from quarc_ref.streams.resync import (
    ResumeConditions,
    ResumptionSearch,
    SearchBudget,
    parse_ordinal,
)
from quarc_ref.streams.source import BytesLike, Source, as_source


@dataclass(frozen=True, slots=True)
class Gap:
    """A part of a stream that could not be decoded.

    Attributes:
        offset: Offset of the first byte in the stream.
        byte_count: Length in bytes; None if the stream has not been read to its end.
        reject_id: Reject id of the error at the beginning of the gap (SPEC 3.3).
        message: Message of the error.
        frames_lost: Number of lost frames; None if unknown.
    """

    offset: int
    byte_count: int | None
    reject_id: str
    message: str
    frames_lost: int | None


def recover(
    stream: BytesLike | Source, follow: Follow | None = None, decoder: StreamDecoder | None = None
) -> Iterator[Scene | Gap]:
    """Decode the frames of a stream that may be damaged.

    After damage, decoding continues at the next CANO chunk with valid CRCs, or at a snapshot that
    is coded against a decoded CANO. A damaged ancillary chunk is skipped without losing frames. A
    truncated stream ends in a gap with the reject id `truncated`.

    Args:
        stream: A stream.
        follow: How to wait for a growing stream; None to stop at the stream's current end.
        decoder: See `decode`.

    Yields:
        Scenes of intact frames, and the gaps between them.

    Raises:
        BitstreamError: The stream cannot be decoded because its HEAD is damaged or because it
            has a critical chunk of an unknown type.
        LimitError: A stream at the unlimited level exceeds the limits of this decoder.
        SourceError: The file, pipe or server cannot be read.
    """
    recovery = _Recovery(as_source(stream), follow, decoder or StreamDecoder())
    recovery.read_head()
    while not recovery.is_finished:
        yield from recovery.step()


class _Recovery:
    def __init__(self, source: Source, follow: Follow | None, decoder: StreamDecoder) -> None:
        self.is_finished = False
        self._source = source
        self._follow = follow
        self._reader = ChunkReader(source)
        self._decoder = decoder
        self._search_budget = SearchBudget(0)
        self._first_frame: int | None = None  # ordinal of the stream's first frame, if decoded
        self._next_frame: int | None = None  # ordinal of the next frame

    def read_head(self) -> None:
        """Read HEAD, which must be intact."""
        self._push(self._read())
        self._search_budget = SearchBudget(self._decoder.header.limits.chunk_bytes)

    def step(self) -> Iterator[Scene | Gap]:
        """Decode a chunk; if it is invalid, go to a chunk at which decoding can resume."""
        try:
            chunk = self._read()
            self.is_finished = chunk is None
            scene = self._push(chunk)
        except UnknownCriticalError:
            raise
        except BitstreamError as error:
            yield from self._skip_damage(error)
        else:
            if scene is not None:
                yield scene

    def _read(self) -> Chunk | None:
        return poll(self._reader.read_chunk, self._follow)

    def _push(self, chunk: Chunk | None) -> Scene | None:
        state = None if chunk is None else self._decoder.push(chunk)
        if state is None:
            return None
        if self._next_frame is None:
            self._first_frame = state.frame
        self._next_frame = state.frame + 1
        return state.scene

    def _skip_damage(self, error: BitstreamError) -> Iterator[Gap]:
        offset, header = error.offset or 0, self._reader.current_header
        if self._reader.is_past_tail and header is None:  # bytes follow TAIL
            self.is_finished = True
            size = self._source.size()
            yield _make_gap(error, offset, size, None)
        elif header is not None and header.is_ancillary and not isinstance(error, TruncatedError):
            self._reader.skip(header)
            yield _make_gap(error, offset, header.end, 0)
        else:
            if header is not None and isinstance(error, PayloadCrcError):
                self._search_budget.spend(header.length)  # [13-2]
            self._decoder.mark_lost()  # [11.4-3]
            yield from self._resume(error, offset)

    def _resume(self, error: BitstreamError, offset: int) -> Iterator[Gap]:
        reference = self._decoder.reference
        conditions = ResumeConditions(
            offset=self._reader.offset,
            sequence=self._reader.sequence,
            frame=self._next_frame or 0,
            max_payload_bytes=self._decoder.header.limits.chunk_bytes,
            budget=self._search_budget,
            canonical=None if reference is None else reference.frame,
        )
        follow = None if isinstance(error, TruncatedError) else self._follow
        search = ResumptionSearch(self._source, conditions, is_growing=follow is not None)
        try:
            resumption = poll(search.find, follow)
        except TruncatedError as end_error:
            self.is_finished = True
            yield _make_gap(error, offset, end_error.offset, None)
            if not isinstance(error, TruncatedError):
                yield _make_gap(end_error, end_error.offset or 0, end_error.offset, None)
            return
        self._reader.seek(resumption.offset, resumption.sequence)
        yield _make_gap(
            error, offset, resumption.offset, self._count_lost_frames(resumption)
        )  # [11.4-2]

    def _count_lost_frames(self, resumption: ChunkHeader) -> int | None:
        """Count the missing frames before the chunk at which decoding resumes."""
        expected_frame, self._next_frame = self._next_frame, self._read_ordinal(resumption)
        if expected_frame is None or self._next_frame is None or self._next_frame < expected_frame:
            return None
        return self._next_frame - expected_frame

    def _read_ordinal(self, resumption: ChunkHeader) -> int | None:
        """Return the ordinal of a CANO or SNAP; for TAIL, that of the last frame plus 1.

        For TAIL, the result is None if the stream's first frame was not decoded.
        """
        payload = self._source.read(resumption.payload_offset, TAIL_BYTES)
        if resumption.kind in container.CANONICAL_TYPES:
            return parse_ordinal(payload)
        if self._first_frame is None:
            return None
        return self._first_frame + wire.parse_tail(payload).frame_count


def _make_gap(error: BitstreamError, offset: int, end: int | None, frames_lost: int | None) -> Gap:
    byte_count = None if end is None else end - offset
    return Gap(offset, byte_count, error.reject_id, str(error), frames_lost)
