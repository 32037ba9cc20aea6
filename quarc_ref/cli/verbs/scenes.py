"""The `import` command: encodes Gaussians from other methods into a stream."""

from collections.abc import Iterator, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AXES, STANDARD_STREAM, AsJson, Force, FrameRate, Quiet, UpAxis
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json, print_message
from quarc_ref.cli.targets import open_output_stream
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.encoder.scenes.bounds import Bounds
    from quarc_ref.encoder.scenes.encode_scenes import GivenFrame, SceneOptions, SceneReport
    from quarc_ref.export.frames_in import ImportedFrames


def import_frames(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="SOURCE",
            help="Folder of PLY or SPZ files, one per frame; or a .4dgs, PLY or SPZ file.",
            show_default=False,
            exists=True,
        ),
    ],
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FILE", help="Stream to write; - for standard output."
        ),
    ],
    profile: Annotated[
        Literal["fine", "coarse"],
        typer.Option(
            "--profile",
            help="Set of error bounds. coarse gives smaller streams than fine: most bounds are "
            "two to three times as large, and even larger where errors are less visible.",
        ),
    ] = "fine",
    bound: Annotated[
        list[str] | None,
        typer.Option(
            "--bound",
            metavar="NAME=VALUE",
            help="Maximum error of an attribute: position (world units), rotation (radians), "
            "log_scale, opacity (logit), sh_dc or sh_rest. position_share gives the bound of "
            "positions, unless position is given, as a fraction of the median scale of the "
            "Gaussians in the first frame. most_slack is the largest factor by "
            "which the bounds of position and rotation may grow where errors are less visible. "
            "May be repeated.",
        ),
    ] = None,
    fps: FrameRate = None,
    keyframe_interval: Annotated[
        int,
        typer.Option(
            "--keyframe-interval",
            min=0,
            metavar="N",
            help="Make every N-th frame a keyframe (a canonical frame); 0: as few keyframes as "
            "possible.",
        ),
    ] = 0,
    up: UpAxis = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Encode Gaussians that another method has trained; no pictures are needed.

    Gaussians are identified across frames by their ids or by the order of rows. Every frame is
    decoded and compared with the input, so that no error exceeds its bound.
    """
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.encoder.scenes.bounds import PROFILES
        from quarc_ref.encoder.scenes.encode_scenes import encode_scenes
        from quarc_ref.export.frames_in import open_frames

        if as_json and str(output) == STANDARD_STREAM:
            message = "-o - and --json both write to standard output: give a path to -o"
            raise UsageError(message)
        bounds = _change_bounds(PROFILES[profile], bound or [])
        _reject_capture(source)
        frames = open_frames(source, fps)
        _warn_about_file_numbers(frames)
        options = _make_options(frames, fps, up)
        options = replace(
            options, bounds=bounds, keyframe_interval=keyframe_interval, progress=progress
        )
        with open_output_stream(output, force=force) as sink:
            report = encode_scenes(_read_frames(frames), sink, options)
        if report.dropped_sh_degree:
            print_message("SH degrees above 1, or above that of the first frame, are dropped")
        if report.unplanned_keyframes:
            print_message(
                f"{report.unplanned_keyframes} of {format_count(report.frames, 'frame')} became "
                "keyframes, which take more bytes, because most of their Gaussians match none of "
                "the frame before: if your method keeps them, write them in the same order in "
                "every frame"
            )
        _print_result(output, report, as_json=as_json)


def _reject_capture(source: Path) -> None:
    """Raise UsageError if the source is a capture or a folder of videos, which are for `encode`."""
    if source.is_file():
        return
    from quarc_ref.datasets.layouts.table import describe_capture

    description = describe_capture(source)
    if description is not None:
        message = (
            f"{source} is {description}, but quarc-ref import reads Gaussians that another method "
            "has trained: to make a stream from pictures, use quarc-ref encode (if the pictures "
            "have no poses, run quarc-ref calibrate first)"
        )
        raise UsageError(message)


def _warn_about_file_numbers(frames: "ImportedFrames") -> None:
    """Print a message if the numbers in file names, which `compare` uses, are not those of frames.

    Frames of a stream have consecutive numbers, so a missing file shifts all later frames.
    """
    from quarc_ref.datasets.frame_numbers import find_gap

    numbers, first_frame = frames.file_numbers, frames.sidecar.first_frame
    if numbers and numbers != tuple(range(first_frame, first_frame + frames.count)):
        print_message(
            f"the numbers of the files ({_format_range(numbers)}) differ from those of the frames "
            f"({_format_range(range(first_frame, first_frame + frames.count))}), which begin with "
            f"{first_frame} and have no gaps{_describe_gap(find_gap(list(map(str, numbers))))}"
        )


def _describe_gap(gap: tuple[str, str] | None) -> str:
    """Return the effect of missing files, to append to a message; empty if none are missing."""
    if gap is None:
        return ""
    return (
        f": there is no file between {gap[0]} and {gap[1]}, so all later frames are shown too "
        "early; add the missing files, and import again"
    )


def _format_range(numbers: Sequence[int]) -> str:
    first, last = numbers[0], numbers[-1]
    return f"{first}" if len(numbers) == 1 else f"{first} to {last}"


def _read_frames(frames: "ImportedFrames") -> "Iterator[GivenFrame]":
    from quarc_ref.encoder.scenes.encode_scenes import GivenFrame

    for splats, ids in frames.read():
        yield GivenFrame(splats, ids)


def _make_options(frames: "ImportedFrames", fps: float | None, up: str | None) -> "SceneOptions":
    """Return the options from the source's sidecar and files, overridden by `--fps` and `--up`."""
    from quarc_ref.encoder.scenes.encode_scenes import SceneOptions

    options, sidecar = SceneOptions(), frames.sidecar
    up_axis = AXES.index(up) + 1 if up else 0
    # The settings in the sidecar are those of the encode that it comes from, not of these frames.
    metadata = {key: text for key, text in sidecar.metadata.items() if key != "settings"}
    return replace(
        options,
        frames_per_second=fps or frames.frames_per_second or options.frames_per_second,
        frame_count=frames.count,
        cameras=sidecar.cameras,
        metadata=metadata,
        first_frame=sidecar.first_frame,
        header=replace(
            options.header,
            up_axis=up_axis or sidecar.up_axis,
            right_handed=sidecar.right_handed,
            meters_per_unit=sidecar.meters_per_unit,
        ),
    )


def _change_bounds(bounds: "Bounds", changes: list[str]) -> "Bounds":
    """Return the bounds, changed by the values of `--bound`.

    Raises:
        UsageError: A change is malformed, or its value is not allowed for the bound.
    """
    names = [field.name for field in fields(bounds) if field.name != "median_scale"]
    for change in changes:
        name, _, text = change.partition("=")
        if name not in names:
            message = (
                f"--bound takes NAME=VALUE, where NAME is one of {', '.join(names)}; got {change!r}"
            )
            raise UsageError(message)
        try:
            bounds = replace(bounds, **{name: float(text)})
        except ValueError as error:
            message = f"--bound {change}: {error}"
            raise UsageError(message) from error
        if name == "position" and not bounds.position:  # would be computed from the first frame
            message = f"--bound {change}: position is 0, but it must be a positive number"
            raise UsageError(message)
    return bounds


def _print_result(output: Path, report: "SceneReport", *, as_json: bool) -> None:
    """Print the size and the errors of a stream, unless it was written to standard output."""
    from dataclasses import asdict

    if str(output) == STANDARD_STREAM:
        return
    size, errors, bounds = output.stat().st_size, asdict(report.errors), report.bounds.as_dict()
    if as_json:
        summary = {"file": str(output), "frames": report.frames, "bytes": size}
        other_values = {
            "dropped_sh_degree": report.dropped_sh_degree,
            "unplanned_keyframes": report.unplanned_keyframes,
        }
        print_json("import/2", {**summary, "bounds": bounds, "errors": errors, **other_values})
        return
    rows = {"frames": f"{report.frames}", "whole stream": f"{size:,} bytes"}
    rows |= {name: f"error {errors[name]:.3g}, bound {bounds[name]:.3g}" for name in errors}
    print_fields(output.name, rows)
