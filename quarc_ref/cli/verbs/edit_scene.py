"""The `edit` command: changes the content of all frames of a stream in the same way."""

from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, BinaryIO, Literal

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import STANDARD_STREAM, AsJson, Force, Quiet, StreamName
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json
from quarc_ref.cli.targets import open_output_stream

if TYPE_CHECKING:
    from quarc_ref.encoder.scenes.edits import Edit
    from quarc_ref.encoder.scenes.encode_scenes import SceneReport
    from quarc_ref.encoder.scenes.recolor import Recoloring
    from quarc_ref.streams import Source

_COLOR_CHANGES = {"gain": 1.0, "red": 0.0, "green": 0.0, "blue": 0.0}  # with defaults


def edit(
    file: StreamName,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Stream to write; - for standard output."
        ),
    ],
    crop: Annotated[
        list[str] | None,
        typer.Option(
            "--crop",
            metavar="X,Y,Z,X,Y,Z",
            help="Keep only Gaussians inside a box, given by any two opposite corners in world "
            "units. If repeated, Gaussians must be inside all boxes.",
        ),
    ] = None,
    drop: Annotated[
        list[str] | None,
        typer.Option(
            "--drop",
            metavar="X,Y,Z,R",
            help="Remove Gaussians inside a sphere, given by center and radius in world units; may "
            "be repeated.",
        ),
    ] = None,
    transform: Annotated[
        str | None,
        typer.Option(
            "--transform",
            metavar="M",
            help="Rotate, scale and shift by a 3x4 or 4x4 matrix: numbers row by row, separated by "
            "commas, such as 1,0,0,0.5,0,1,0,0,0,0,1,0.",
        ),
    ] = None,
    recolor: Annotated[
        list[str] | None,
        typer.Option(
            "--recolor",
            metavar="NAME=VALUE",
            help="Change colors: gain multiplies all channels; red, green and blue are offsets "
            "that are added to their channel (1 is white). May be repeated.",
        ),
    ] = None,
    profile: Annotated[
        Literal["fine", "coarse"],
        typer.Option("--profile", help="Set of error bounds for edits that fit frames again."),
    ] = "fine",
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Crop, drop, transform or recolor the Gaussians of all frames.

    No pictures are needed. An edit that only changes colors does not fit frames again; color
    offsets are rounded to whole codes. Any other edit changes the anchors. All frames are then
    fitted again, as in `import`, and no error exceeds its bound.
    """
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.streams import open_source

        if as_json and str(output) == STANDARD_STREAM:
            message = "-o - and --json both write to standard output: give a path to -o"
            raise UsageError(message)
        requested_edit = _parse_edit(crop or [], drop or [], transform, recolor or [])
        with open_source(file) as source, open_output_stream(output, force=force) as sink:
            count, report = _write_edited(source, sink, requested_edit, profile, progress)
        _print_result(output, count, report, as_json=as_json)


def _write_edited(
    source: "Source",
    sink: BinaryIO,
    requested_edit: "Edit",
    profile: str,
    progress: TerminalProgress,
) -> "tuple[int, SceneReport | None]":
    """Write the edited stream; return its frame count, and a report if frames were fitted again.

    Raises:
        UsageError: The edit is not possible for this stream.
        BitstreamError: The stream is invalid.
    """
    from quarc_ref.encoder.scenes.bounds import PROFILES
    from quarc_ref.encoder.scenes.encode_scenes import SceneOptions
    from quarc_ref.encoder.scenes.fit_edit import encode_edited
    from quarc_ref.encoder.scenes.recolor import recolor
    from quarc_ref.format.errors import EncodeError

    try:
        if requested_edit.changes_only_colors and requested_edit.recoloring:
            return recolor(source, sink, requested_edit.recoloring), None
        options = replace(SceneOptions(bounds=PROFILES[profile]), progress=progress)
        report = encode_edited(source, sink, requested_edit, options)
    except EncodeError as error:
        raise UsageError(str(error)) from error
    return report.frames, report


def _parse_edit(
    crop: list[str], drop: list[str], transform: str | None, recolor: list[str]
) -> "Edit":
    """Return the edit that the options describe.

    Raises:
        UsageError: An option is malformed, or no edit is given.
    """
    import numpy as np

    from quarc_ref.encoder.scenes.edits import Edit, Similarity

    boxes = tuple(_sort_corners(_parse_numbers("--crop", text, (6,))) for text in crop)
    spheres = tuple(_parse_numbers("--drop", text, (4,)) for text in drop)
    similarity = None
    if transform is not None:
        numbers = np.array(_parse_numbers("--transform", transform, (12, 16)))
        try:
            similarity = Similarity.from_matrix(numbers.reshape(-1, 4))
        except ValueError as error:
            message = f"--transform: {error}"
            raise UsageError(message) from error
    if any(radius < 0 for *_, radius in spheres):
        message = "--drop takes a radius of at least 0"
        raise UsageError(message)
    requested_edit = Edit(
        boxes, spheres, similarity, _parse_recoloring(recolor) if recolor else None
    )
    if requested_edit == Edit():
        message = "no edit is given: use --crop, --drop, --transform or --recolor"
        raise UsageError(message)
    return requested_edit


def _parse_numbers(option: str, text: str, counts: Sequence[int]) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.replace(",", " ").split())
    except ValueError:
        numbers = ()
    if len(numbers) not in counts or not all(abs(number) < float("inf") for number in numbers):
        noun = "number" if counts == (1,) else "numbers"
        message = f"{option} takes {' or '.join(map(str, counts))} {noun}, not {text!r}"
        raise UsageError(message)
    return numbers


def _sort_corners(box: tuple[float, ...]) -> tuple[float, ...]:
    """Return the smallest and the largest coordinates of a box with two opposite corners."""
    axes = list(zip(box[:3], box[3:], strict=True))
    return (*map(min, axes), *map(max, axes))


def _parse_recoloring(changes: list[str]) -> "Recoloring":
    from quarc_ref.encoder.scenes.recolor import Recoloring

    values: dict[str, float] = {}
    for change in changes:
        name, _, text = change.partition("=")
        if name not in _COLOR_CHANGES:
            message = (
                f"--recolor takes NAME=VALUE, where NAME is one of {', '.join(_COLOR_CHANGES)}; "
                f"got {change!r}"
            )
            raise UsageError(message)
        if name in values:
            message = f"--recolor {name} is given twice"
            raise UsageError(message)
        (values[name],) = _parse_numbers(f"--recolor {name}", text, (1,))
    gain, red, green, blue = (values.get(name, default) for name, default in _COLOR_CHANGES.items())
    if gain <= 0:
        message = "--recolor gain=VALUE takes a number above 0"
        raise UsageError(message)
    return Recoloring(gain, (red, green, blue))


def _print_result(output: Path, count: int, report: "SceneReport | None", *, as_json: bool) -> None:
    """Print the size and the errors of a stream, unless it was written to standard output."""
    if str(output) == STANDARD_STREAM:
        return
    size, method = output.stat().st_size, "fitted" if report else "exact"
    bounds = report and report.bounds.as_dict()
    errors = report and asdict(report.errors)
    if as_json:
        summary = {"file": str(output), "frames": count, "bytes": size, "method": method}
        print_json("edit/1", {**summary, "bounds": bounds, "errors": errors})
        return
    method_text = (
        "only colors; offsets are rounded to whole codes"
        if report is None
        else "fitted again; all errors are within their bounds"
    )
    rows = {"frames": f"{count}", "whole stream": f"{size:,} bytes", "edit": method_text}
    if bounds and errors:
        rows |= {name: f"error {errors[name]:.3g}, bound {bounds[name]:.3g}" for name in errors}
    print_fields(output.name, rows)
