"""Options and arguments that several commands share, and functions that check and parse them."""

import os
import re
import stat
from pathlib import Path
from typing import Annotated, NoReturn
from urllib.parse import unquote

import typer

from quarc_ref.cli.completion import complete_setting
from quarc_ref.cli.errors import UsageError

STANDARD_STREAM = "-"
AXES = ("x", "-x", "y", "-y", "z", "-z")  # in the order of a stream's header
_MAX_SEED = (1 << 64) - 1
_MAX_DIGITS = 20  # frame numbers have fewer digits


def is_path_name(name: str) -> bool:
    """Return whether the name of a stream is a path, not a URL or `-`."""
    return name != STANDARD_STREAM and not name.lower().startswith(("http://", "https://"))


def format_stream_name(name: str) -> str:
    """Return the name of a stream in output: a file name, or `standard input`.

    User, password and query of a URL are left out, because they may contain secrets.
    """
    if name == STANDARD_STREAM:
        return "standard input"
    if is_path_name(name):
        return Path(name).name
    path = re.split(r"[?#]", name)[0].rstrip("/")
    address_or_name = path.rpartition("/")[2]
    is_address = path.count("/") == 2
    return address_or_name.rpartition("@")[2] if is_address else unquote(address_or_name)


def check_stream_name(name: str) -> str:
    """Check that the file of a stream exists; URLs and `-` are not checked.

    Raises:
        BadParameter: The path does not exist, or is not a file.
    """
    if is_path_name(name) and not stat.S_ISREG(_get_mode_unless_folder(name)):
        _reject(name, "is not a regular file; use - for standard input")
    return name


def check_stream_file(name: str) -> str:
    """Check that the name of a stream is the path of an existing file.

    Raises:
        BadParameter: The name is a URL or `-`, or the path does not exist or is a folder.
    """
    require_path_name(name)
    _get_mode_unless_folder(name)
    return name


def require_path_name(name: str) -> None:
    """Raise BadParameter if a name is a URL or `-`."""
    if not is_path_name(name):
        _reject(name, "is not a file; this command accepts only files, not URLs or standard input")


def check_folder(path: Path) -> Path:
    """Check that a folder exists.

    Raises:
        BadParameter: The path does not exist, or is not a folder.
    """
    if not stat.S_ISDIR(_get_path_mode(str(path))):
        _reject(str(path), "is not a folder")
    return path


def check_path_exists(path: str) -> None:
    """Check that a path exists.

    Raises:
        BadParameter: The path does not exist.
    """
    _get_path_mode(path)


def check_axis(name: str | None) -> str | None:
    """Return the name of an axis, such as `x` or `-x`, without a plus sign.

    Raises:
        BadParameter: The name is not one of `AXES`.
    """
    axis = None if name is None else name.removeprefix("+")
    if axis is not None and axis not in AXES:
        message = f"{name!r} is not one of {', '.join(AXES)}."
        raise typer.BadParameter(message)
    return axis


def check_seed(seed: int) -> int:
    """Check that a seed is not too large.

    `max` of the option would do the same, but the number would fill half of a table in `--help`.

    Raises:
        BadParameter: The seed is too large.
    """
    if seed > _MAX_SEED:
        message = f"{seed} is above {_MAX_SEED}."
        raise typer.BadParameter(message)
    return seed


def _get_mode_unless_folder(path: str) -> int:
    mode = _get_path_mode(path)
    if stat.S_ISDIR(mode):
        _reject(path, "is a folder")
    return mode


def _get_path_mode(path: str) -> int:
    """Return the file mode of a path; raise BadParameter if the path does not exist."""
    try:
        return os.stat(path).st_mode
    except (FileNotFoundError, NotADirectoryError):
        _reject(path, "does not exist")
    except OSError as error:
        _reject(path, f"cannot be found: {error.strerror}")


def _reject(path: str, problem: str) -> NoReturn:
    message = f"{path!r} {problem}."
    raise typer.BadParameter(message)


StreamFile = Annotated[
    str,
    typer.Argument(
        metavar="FILE",
        help="A .quarc stream in a file.",
        show_default=False,
        callback=check_stream_file,
    ),
]
StreamName = Annotated[
    str,
    typer.Argument(
        metavar="FILE",
        help="A .quarc stream: a file, an http(s) URL, or - for standard input.",
        show_default=False,
        callback=check_stream_name,
    ),
]
Frames = Annotated[
    str | None,
    typer.Option(
        "--frames",
        metavar="A:B",
        help="Frames A to B - 1; A without a colon selects a single frame. Default: all frames.",
    ),
]
FrameRate = Annotated[
    float | None,
    typer.Option(
        "--fps",
        min=1e-3,
        max=1e3,
        help="Frames per second.",
        show_default="from the source, else 30",
    ),
]
CaptureFolder = Annotated[
    Path,
    typer.Argument(
        metavar="CAPTURE",
        help="Folder of a capture, in the layout of N3DV, COLMAP, nerfstudio, EasyMocap or "
        "Panoptic Studio; quarc-ref doctor reports what is missing.",
        show_default=False,
        readable=False,  # an unreadable folder is not a usage error; `open_capture` reports it
        callback=check_folder,
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Change a setting, such as motion.lr=5e-4; may be repeated. encode --list-settings "
        "prints all settings.",
        autocompletion=complete_setting,
    ),
]
UpAxis = Annotated[
    str | None,
    typer.Option(
        "--up",
        metavar="AXIS",
        help="Axis that points up: x, -x, y, -y, z or -z.",
        show_default="from the stream or the files",
        callback=check_axis,
    ),
]
LpipsWeights = Annotated[
    Path | None,
    typer.Option(
        "--lpips",
        metavar="WEIGHTS",
        help="Also measure LPIPS; WEIGHTS is a file with the saved state_dict() of "
        "lpips.LPIPS(net='vgg').",
        show_default="no LPIPS",
    ),
]
Seed = Annotated[
    int, typer.Option("--seed", min=0, callback=check_seed, help="Seed of all random numbers.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Force = Annotated[
    bool,
    typer.Option(
        "--force",
        "-f",
        help="Replace an existing file, or a folder that contains only files written by quarc-ref.",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Do not show progress.")]


def parse_frames(text: str | None) -> tuple[int, int | None]:
    """Return the first frame and the exclusive end of a range; the end is None if it is open.

    Args:
        text: `A:B`, where A or B may be omitted, or `A` for a single frame; None for all frames.

    Raises:
        UsageError: The text is not a valid range.
    """
    if text is None:
        return 0, None
    start_text, colon, stop_text = text.partition(":")
    numbers = [start_text or "0", stop_text or "0"] if colon else [start_text]
    if not all(number.isdecimal() and len(number) < _MAX_DIGITS for number in numbers):
        message = f"--frames takes a range A:B, such as 0:10, or a frame, such as 7, not {text!r}"
        raise UsageError(message)
    start = int(numbers[0])
    if not colon:
        return start, start + 1
    stop = int(stop_text) if stop_text else None
    if stop is not None and stop <= start:
        message = f"--frames {text} is empty: A:B means frames A to B - 1"
        raise UsageError(message)
    return start, stop
