"""Limits of a stream's level: SPEC 3.2. Counts are checked before memory is allocated."""

from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import CountLevelError, LimitError
from quarc_ref.format.records import StreamHeader


def require_gaussians(header: StreamHeader, count: int) -> None:
    """Reject a canonical frame of too many Gaussians.

    Raises:
        CountLevelError: More than the level of the stream allows.
        LimitError: More than this decoder allows at the unlimited level.
    """
    if count > header.limits.gaussians:  # [3.2-1] [3.2-5] [3.2-6]
        message = f"{count} Gaussians are too many for level {header.level}"
        raise CountLevelError(message)
    _decline_beyond(_OWN_LIMITS.gaussians, count, "Gaussians")


def require_births(header: StreamHeader, count: int, gaussian_count: int) -> None:
    """Reject a frame of too many births.

    Args:
        header: Header of the stream.
        count: How many births.
        gaussian_count: Gaussians of the scene without them.

    Raises:
        CountLevelError: More than the level of the stream allows.
        LimitError: More than this decoder allows at the unlimited level.
    """
    if count > header.limits.births:  # [3.2-3] [3.2-5]
        message = f"{count} births are too many for level {header.level}"
        raise CountLevelError(message)
    _decline_beyond(_OWN_LIMITS.births, count, "births")
    _decline_beyond(_OWN_LIMITS.gaussians, gaussian_count + count, "Gaussians")


def _decline_beyond(most: int, count: int, what: str) -> None:
    """Decline what exceeds this decoder's own limits, which apply only at the unlimited level.

    Raises:
        LimitError: It exceeds them; the stream is not at fault.
    """
    if count > most:
        message = f"{count:,} {what} are more than this decoder takes, {most:,}"
        raise LimitError(message)


_OWN_LIMITS = LEVELS[30]  # what stands at the unlimited level
