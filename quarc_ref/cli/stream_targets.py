"""Where `encode` writes a stream, so that an encode that breaks off can be gone on with."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from quarc_ref.cli.faults import UsageError
from quarc_ref.cli.targets import refuse_target

_PART = ".part"


@contextmanager
def growing_stream(target: Path, *, force: bool, live: bool, resume: bool) -> Iterator[Path]:
    """Name the file to write a stream into; it may have the beginning of that stream.

    The file is `<target>.part` and takes the target's place when the stream is
    whole. Whatever happens before, it stays, unless it is empty.

    Args:
        target: Where the stream is to be.
        force: Whether to replace a target, or a part that is not resumed.
        live: Whether to write the target in its own place, so that others can
            read along.
        resume: Whether to go on with the part, or with the target if that is
            where there is a stream.

    Raises:
        UsageError: The target cannot be written so.
    """
    place = _choose_resumed(target, live=live) if resume else _choose_new(target, live=live)
    refuse_target(target, force=force or (resume and place == target))
    if not resume:
        _clear(place, force=force)
    try:
        yield place
    except KeyboardInterrupt as error:
        if not _holds_something(place):
            raise
        message = (
            f"interrupted; {place} holds the frames that were written: --resume goes on with them"
        )
        raise KeyboardInterrupt(message) from error
    finally:
        if place.is_file() and not _holds_something(place):
            place.unlink()
    if place != target:
        place.replace(target)


def _choose_new(target: Path, *, live: bool) -> Path:
    return target if live else _name_part(target)


def _choose_resumed(target: Path, *, live: bool) -> Path:
    part = _name_part(target)
    at_target = live or (_holds_something(target) and not _holds_something(part))
    return target if at_target else part


def _clear(place: Path, *, force: bool) -> None:
    """Remove what is in a place; who reads it keeps it."""
    if _holds_something(place) and not force:
        message = f"{place} is what an encode has left: --resume goes on, --force begins anew"
        raise UsageError(message)
    place.unlink(missing_ok=True)


def _name_part(target: Path) -> Path:
    return target.with_name(target.name + _PART)


def _holds_something(path: Path) -> bool:
    return path.is_file() and path.stat().st_size > 0
