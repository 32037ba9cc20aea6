"""Verifies a whole stream: decodes it with both entropy decoders, and from every seek point."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.reference_engine import ReferenceEngine
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format import container, wire
from quarc_ref.format.coding.entropy import HAS_CONSTRICTION, use_bit_decoder
from quarc_ref.format.container import Chunk
from quarc_ref.format.errors import VerificationError
from quarc_ref.inspection.cross_check import CrossChecker
from quarc_ref.inspection.inspect_stream import count_frames
from quarc_ref.streams.chunk_reader import ChunkReader
from quarc_ref.streams.decode_stream import decode
from quarc_ref.streams.follow import Follow, poll
from quarc_ref.streams.source import Source


@dataclass(frozen=True, slots=True)
class Verification:
    """Results of verifying a stream.

    Attributes:
        frames: Number of frames, all with correct state CRCs.
        chunks: Number of chunks of known types, all with correct CRCs.
        entropy_decoders: Number of entropy decoders that agree: 2, or 1 without constriction.
        sections: Number of decoded sections.
        bits: Number of bits in these sections.
        seek_points: Number of seek points from which decoding was started.
        frames_compared: Number of frames that were decoded again from seek points, all with the
            same digests as in the first pass.
        level: Conformance level in the stream header.
        maxima: Largest number of Gaussians in a frame, of births in a frame, and of bytes in a
            payload.
        limits: Limit of the level for each value of `maxima`.
        sha256: Digest of the last state; None in a stream without frames.
    """

    frames: int
    chunks: int
    entropy_decoders: int
    sections: int
    bits: int
    seek_points: int
    frames_compared: int
    level: int
    maxima: dict[str, int]
    limits: dict[str, int]
    sha256: str | None

    def as_json(self) -> dict[str, Any]:
        """Return the values for `verify --deep --json`."""
        results = asdict(self)
        del results["sha256"]
        return results | {"level": self.level / 10}


def verify_stream(
    source: Source,
    on_progress: Callable[[str, int, int], None] = lambda *_: None,
    follow: Follow | None = None,
) -> Verification:
    """Verify a stream.

    Args:
        source: A stream that can be read repeatedly, so not a pipe.
        on_progress: Function called after every frame with the stage, the number of frames so
            far, and the total.
        follow: How to wait for a growing stream; None to stop at the stream's current end.

    Raises:
        BitstreamError: The stream is invalid.
        VerificationError: Two methods of decoding the stream disagree.
        SourceError: The file, pipe or server cannot be read.
    """
    cross_check = CrossChecker()
    verifier = _StreamVerifier(source, on_progress)
    with use_bit_decoder(cross_check.make_decoder):
        while (chunk := poll(verifier.reader.read_chunk, follow)) is not None:
            verifier.push(chunk)
    frames_compared = verifier.decode_from_seek_points(source)
    header = verifier.decoder.header
    return Verification(
        frames=len(verifier.digests),
        chunks=verifier.chunk_count,
        entropy_decoders=2 if HAS_CONSTRICTION else 1,
        sections=cross_check.section_count,
        bits=cross_check.bit_count,
        seek_points=len(verifier.canonical_frames),
        frames_compared=frames_compared,
        level=header.level,
        maxima=verifier.maxima,
        limits=header.limits._asdict(),
        sha256=list(verifier.digests.values())[-1] if verifier.digests else None,
    )


class _StreamVerifier:
    """Decodes a stream from its beginning, then again from every seek point."""

    def __init__(self, source: Source, on_progress: Callable[[str, int, int], None]) -> None:
        self.reader = ChunkReader(source)
        self.decoder = StreamDecoder(ReferenceEngine())  # decodes sections with both decoders
        self.digests: dict[int, str] = {}  # by ordinal
        self.canonical_frames: list[int] = []
        self.chunk_count = 0
        self.maxima = {"gaussians": 0, "births": 0, "chunk_bytes": 0}
        self._on_progress = on_progress
        self._total = count_frames(source)

    def push(self, chunk: Chunk) -> None:
        """Decode a chunk and record its digest and sizes."""
        state = self.decoder.push(chunk)
        self.chunk_count += 1
        if chunk.kind != container.HEAD:
            self._update_maximum("chunk_bytes", len(chunk.payload))
        if state is None:
            return
        scene = state.scene
        self.digests[scene.frame] = compute_digest(scene)
        self._update_maximum("gaussians", scene.count)
        if chunk.kind in container.CANONICAL_TYPES:
            self.canonical_frames.append(scene.frame)
        else:
            frame_chunk = wire.parse_frame(chunk.payload, updates=scene.header.updates)
            self._update_maximum("births", frame_chunk.birth_count)
        self._on_progress("decode", len(self.digests), self._total)

    def decode_from_seek_points(self, source: Source) -> int:
        """Decode the stream again from every seek point; return the number of decoded frames.

        Raises:
            VerificationError: The state of a frame differs from its state in the first pass.
        """
        compared_count = 0
        for start, stop in zip(
            self.canonical_frames, [*self.canonical_frames[1:], None], strict=False
        ):
            for scene in decode(source, start, stop):
                if compute_digest(scene) != self.digests[scene.frame]:
                    message = (
                        f"frame {scene.frame} decodes to a different state from seek point {start}"
                    )
                    raise VerificationError(message)
                compared_count += 1
                self._on_progress("seek", compared_count, len(self.digests))
        return compared_count

    def _update_maximum(self, name: str, value: int) -> None:
        self.maxima[name] = max(self.maxima[name], value)
