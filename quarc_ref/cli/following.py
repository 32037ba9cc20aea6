"""Options of commands that follow a growing stream."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import report_errors
from quarc_ref.cli.options import STANDARD_STREAM, check_stream_name, is_path_name
from quarc_ref.cli.output import print_message

if TYPE_CHECKING:
    from quarc_ref.streams import Follow

DEFAULT_PATIENCE = 60.0
_POLL_SECONDS = 0.1

# `make_follow_options` checks whether the file exists, so the argument has no callback.
FollowedStreamName = Annotated[
    str,
    typer.Argument(
        metavar="FILE",
        help="A .quarc stream: a file, an http(s) URL, or - for standard input.",
        show_default=False,
    ),
]
FollowFlag = Annotated[
    bool,
    typer.Option(
        "--follow",
        help="Wait for a stream that is being written, or for a file that does not exist yet.",
    ),
]
Patience = Annotated[
    float,
    typer.Option(
        "--patience",
        min=0,
        metavar="SECONDS",
        help="Seconds without new data before --follow gives up.",
    ),
]


def make_follow_options(name: str, patience: float, *, follow: bool) -> "Follow | None":
    """Return the options for waiting at the end of a growing stream; None if `follow` is not set.

    The result is also None for standard input, because reading it blocks until data arrives. If
    `follow` is set and the name is a path that does not exist, wait for the file, for at most
    `patience` seconds; a URL must exist.

    Args:
        name: Path or URL of the stream, or `-`.
        patience: Seconds without new data after which waiting ends.
        follow: Whether to wait for a growing stream.

    Raises:
        BadParameter: The path of the stream does not exist, or is not a file.
    """
    with report_errors():
        if follow and is_path_name(name):
            _wait_for_file(Path(name), patience)
    try:
        check_stream_name(name)
    except typer.BadParameter as error:
        error.param_hint = "'FILE'"  # the hint that typer adds to errors of a callback
        raise
    if not follow or name == STANDARD_STREAM:
        return None
    from quarc_ref.streams import Follow

    return Follow(patience=patience)


def _wait_for_file(path: Path, patience: float) -> None:
    if path.exists():
        return
    print_message(f"waiting for {path}")
    deadline = time.monotonic() + patience
    while not path.exists() and time.monotonic() < deadline:
        time.sleep(_POLL_SECONDS)
