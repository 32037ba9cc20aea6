"""Frame rates that the header of a stream can state: SPEC 5.3."""

from fractions import Fraction

MIN_FRAME_RATE, MAX_FRAME_RATE = 1e-3, 1e6  # frames per second
_DENOMINATOR_LIMIT = 1001  # that of 29.97 and 23.976


def is_frame_rate(frames_per_second: float) -> bool:
    """Return whether a stream can state a frame rate; False for NaN."""
    return MIN_FRAME_RATE <= frames_per_second <= MAX_FRAME_RATE


def to_clock(frames_per_second: float) -> tuple[int, int]:
    """Return the `timescale` and `frame_ticks` of a frame rate.

    Raises:
        ValueError: `is_frame_rate` does not hold.
    """
    if not is_frame_rate(frames_per_second):
        message = (
            f"the frame rate is {frames_per_second}, but must be from {MIN_FRAME_RATE} to "
            f"{MAX_FRAME_RATE} frames per second"
        )
        raise ValueError(message)
    rate = Fraction(frames_per_second).limit_denominator(_DENOMINATOR_LIMIT)
    return rate.numerator, rate.denominator
