"""Checks the limits of a stream's level before memory is allocated: SPEC 3.2."""

from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import CountLevelError, LimitError
from quarc_ref.format.records import StreamHeader


def check_gaussian_count(header: StreamHeader, count: int) -> None:
    """Reject or decline a frame with too many Gaussians.

    Raises:
        CountLevelError: The count is above the limit of the stream's level.
        LimitError: The count is above this decoder's limit at the unlimited level.
    """
    if count > header.limits.gaussians:  # [3.2-1] [3.2-2] [3.2-5] [3.2-6]
        message = f"{count} Gaussians are too many for level {header.level}"
        raise CountLevelError(message)
    _decline_above(_DECODER_LIMITS.gaussians, count, "Gaussians")


def check_birth_count(header: StreamHeader, count: int, gaussian_count: int) -> None:
    """Reject or decline a frame with too many births, or with too many Gaussians after them.

    Args:
        header: Header of the stream.
        count: Number of births.
        gaussian_count: Number of Gaussians in the scene without the births.

    Raises:
        CountLevelError: A count is above the limit of the stream's level.
        LimitError: A count is above this decoder's limit at the unlimited level.
    """
    if count > header.limits.births:  # [3.2-3] [3.2-5]
        message = f"{count} births are too many for level {header.level}"
        raise CountLevelError(message)
    _decline_above(_DECODER_LIMITS.births, count, "births")
    check_gaussian_count(header, gaussian_count + count)


def check_payload_bytes(byte_count: int) -> None:
    """Decline a payload that is too long for this decoder; its level has been checked before.

    Raises:
        LimitError: The number is above this decoder's limit at the unlimited level.
    """
    _decline_above(_DECODER_LIMITS.chunk_bytes, byte_count, "bytes of a payload")


def find_max_births(header: StreamHeader, gaussian_count: int) -> int:
    """Return the largest number of births that this decoder accepts in a frame.

    Args:
        header: Header of the stream.
        gaussian_count: Number of Gaussians in the scene without the births.
    """
    levels = (header.limits, _DECODER_LIMITS)
    max_births = min(level.births for level in levels)
    return max(0, min(max_births, *(level.gaussians - gaussian_count for level in levels)))


def _decline_above(limit: int, count: int, noun: str) -> None:
    """Decline a count above this decoder's own limit; only the unlimited level allows more.

    Raises:
        LimitError: The count is above the limit, although the stream is valid.
    """
    if count > limit:
        message = f"{count:,} {noun} exceed this decoder's limit of {limit:,}"
        raise LimitError(message)


_DECODER_LIMITS = LEVELS[30]  # limits of this decoder for streams at the unlimited level
