"""Plain and compiled kernels side by side: the same integers, floats and refusals."""

import zlib
from collections.abc import Iterator

from quarc_ref.decoder import compute_digest, decode, dequantize
from quarc_ref.format.acceleration import COMPILED, PLAIN, computing_with
from quarc_ref.format.errors import BitstreamError, LimitError, ProofError

_End = BitstreamError | LimitError | None


def decode_by_both_kernels(data: bytes) -> Iterator[str]:
    """Decode a stream with plain kernels, and with compiled ones.

    Yields:
        A digest of every frame.

    Raises:
        ProofError: They differ in a frame, or in how the stream ends.
        BitstreamError: What is wrong with the stream.
        LimitError: It asks for more than this decoder gives.
    """
    (plain, end), (compiled, other) = (_tell(data, kernels) for kernels in (PLAIN, COMPILED))
    if (plain, repr(end), str(end)) != (compiled, repr(other), str(other)):
        message = f"plain kernels give {plain}, {end!r}; compiled ones {compiled}, {other!r}"
        raise ProofError(message)
    yield from plain
    if end is not None:
        raise end


def _tell(data: bytes, kernels: str) -> tuple[list[str], _End]:
    """Return a digest of every frame, its floats included, and how the stream ends."""
    told = []
    with computing_with(kernels):
        try:
            for scene in decode(data):
                splats = dequantize(scene)
                floats = (
                    *(splats.positions, splats.rotations, splats.log_scales),
                    *(splats.opacities, splats.sh),
                )
                crc = zlib.crc32(b"".join(array.tobytes() for array in floats))
                told.append(f"{compute_digest(scene)} {crc:08x}")
        except (BitstreamError, LimitError) as error:
            return told, error
    return told, None
