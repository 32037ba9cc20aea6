"""Options and arguments that several verbs share, and how they are read."""

from pathlib import Path
from typing import Annotated

import typer

from quarc_ref.cli.faults import UsageError

StreamFile = Annotated[
    Path,
    typer.Argument(
        metavar="FILE", help="A .quarc stream.", show_default=False, exists=True, dir_okay=False
    ),
]
CaptureFolder = Annotated[
    Path,
    typer.Argument(
        metavar="CAPTURE",
        help="A capture: N3DV's layout, a COLMAP model with frames, or transforms.json.",
        show_default=False,
        exists=True,
        file_okay=False,
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Force = Annotated[bool, typer.Option("--force", "-f", help="Replace what exists.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Show no progress.")]


def parse_frames(text: str | None) -> tuple[int, int | None]:
    """Return the first frame of `A:B` and the one after its last; either may be left out.

    Raises:
        UsageError: The text is no such range.
    """
    if text is None:
        return 0, None
    first, colon, last = text.partition(":")
    numbers = [first or "0", last or "0"]
    if not colon or not all(number.isdecimal() for number in numbers):
        message = f"--frames takes A:B, such as 0:10; this is {text!r}"
        raise UsageError(message)
    start, stop = int(numbers[0]), int(last) if last else None
    if stop is not None and stop <= start:
        message = f"--frames {text} is empty: it takes the frames from A up to, and without, B"
        raise UsageError(message)
    return start, stop
