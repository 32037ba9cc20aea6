"""Names the frame in the errors of an encode."""

from collections.abc import Iterator
from contextlib import contextmanager

from quarc_ref.format.errors import EncodeError


@contextmanager
def name_frame_in_errors(frame: int) -> Iterator[None]:
    """Prefix the message of an EncodeError in this context with the number of a frame."""
    try:
        yield
    except EncodeError as error:
        message = f"frame {frame}: {error}"
        raise EncodeError(message) from error
