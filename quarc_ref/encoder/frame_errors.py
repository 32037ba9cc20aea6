"""Names the frame in the errors of an encode."""

from collections.abc import Iterator
from contextlib import contextmanager

from quarc_ref.format.errors import EncodeError


@contextmanager
def name_frame_in_errors(frame: int, place: str = "") -> Iterator[None]:
    """Prefix the message of an EncodeError in this context with the number of a frame.

    Args:
        frame: Number of the frame.
        place: Text after the number, such as " of the capture"; empty for a frame of the stream.
    """
    try:
        yield
    except EncodeError as error:
        message = f"frame {frame}{place}: {error}"
        raise EncodeError(message) from error
