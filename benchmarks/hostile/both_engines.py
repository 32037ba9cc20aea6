"""Decodes streams with both engines, which must return the same frames and the same rejections."""

import zlib
from collections.abc import Iterator

from quarc_ref.decoder import compute_digest
from quarc_ref.decoder.engine import FAST, REFERENCE
from quarc_ref.decoder.engines import use_engine
from quarc_ref.format.errors import BitstreamError, LimitError, VerificationError
from quarc_ref.playback import Player

_FinalError = BitstreamError | LimitError | None


def decode_by_both_engines(data: bytes) -> Iterator[str]:
    """Decode a stream with the reference engine and with the fast engine.

    Yields:
        A digest of every frame.

    Raises:
        VerificationError: The engines return different frames or different errors.
        BitstreamError: The stream is malformed.
        LimitError: The stream exceeds the limits of the decoder.
        EnvironmentVariableError: The fast engine is not installed.
    """
    (digests, reference_error), (fast_digests, fast_error) = (
        _digest_frames(data, engine) for engine in (REFERENCE, FAST)
    )
    reference_result = (digests, _get_comparable_part(reference_error))
    if reference_result != (fast_digests, _get_comparable_part(fast_error)):
        message = (
            f"the engines differ: the reference engine returns {digests}, {reference_error!r}, "
            f"and the fast engine {fast_digests}, {fast_error!r}"
        )
        raise VerificationError(message)
    yield from digests
    if reference_error is not None:
        raise reference_error


def _get_comparable_part(error: _FinalError) -> int | str | None:
    """Return the part of the final error that must be the same for both engines.

    For a rejection, this is the offset of the rejected chunk. The reject ids of the engines can
    differ if the chunk has several faults.
    """
    return error.offset if isinstance(error, BitstreamError) else type(error).__name__


def _digest_frames(data: bytes, engine: str) -> tuple[list[str], _FinalError]:
    """Return a digest of each frame (scene and splats), and the error that ended decoding."""
    digests = []
    with use_engine(engine), Player(data, threads=1) as player:
        try:
            for frame in player:
                splats = frame.splats
                floats = (
                    *(splats.positions, splats.rotations, splats.log_scales),
                    *(splats.opacities, splats.sh),
                )
                crc = zlib.crc32(b"".join(array.tobytes() for array in floats))
                digests.append(f"{compute_digest(frame.scene)} {crc:08x}")
        except (BitstreamError, LimitError) as error:
            return digests, error
    return digests, None
