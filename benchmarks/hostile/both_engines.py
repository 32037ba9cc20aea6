"""Decodes with both engines: they must give the same frames and reject the same streams."""

import zlib
from collections.abc import Iterator

from quarc_ref.decoder import compute_digest
from quarc_ref.decoder.engine import FAST, REFERENCE
from quarc_ref.decoder.engines import use_engine
from quarc_ref.format.errors import BitstreamError, LimitError, VerificationError
from quarc_ref.playback import Player

_End = BitstreamError | LimitError | None


def decode_by_both_engines(data: bytes) -> Iterator[str]:
    """Decode a stream with the reference engine and with the fast engine.

    Yields:
        A digest of every frame.

    Raises:
        VerificationError: The engines differ in a frame or in how the stream ends.
        BitstreamError: The stream is malformed.
        LimitError: The stream exceeds the limits of the decoder.
        EnvironmentVariableError: The fast engine is not installed.
    """
    (frames, end), (fast, other) = (_digest_frames(data, engine) for engine in (REFERENCE, FAST))
    if (frames, _find_rejection(end)) != (fast, _find_rejection(other)):
        message = f"the reference gives {frames}, {end!r}; the fast engine {fast}, {other!r}"
        raise VerificationError(message)
    yield from frames
    if end is not None:
        raise end


def _find_rejection(end: _End) -> int | str | None:
    """Return where a stream was rejected; either of two faults in a chunk may be reported."""
    return end.offset if isinstance(end, BitstreamError) else type(end).__name__


def _digest_frames(data: bytes, engine: str) -> tuple[list[str], _End]:
    """Return a digest of every frame, including its floats, and how the stream ends."""
    output = []
    with use_engine(engine), Player(data, threads=1) as player:
        try:
            for frame in player:
                splats = frame.splats
                floats = (
                    *(splats.positions, splats.rotations, splats.log_scales),
                    *(splats.opacities, splats.sh),
                )
                crc = zlib.crc32(b"".join(array.tobytes() for array in floats))
                output.append(f"{compute_digest(frame.scene)} {crc:08x}")
        except (BitstreamError, LimitError) as error:
            return output, error
    return output, None
