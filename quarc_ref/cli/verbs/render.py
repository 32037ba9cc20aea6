"""The `render` command: renders a camera of a stream as a video or as pictures."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from quarc_ref.cli.errors import report_errors
from quarc_ref.cli.options import AsJson, Force, Frames, Quiet, StreamName, parse_frames
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json
from quarc_ref.cli.render_choices import (
    choose_camera,
    choose_video_format,
    parse_background,
    reject_conflicts,
    require_pixel_limit,
)
from quarc_ref.cli.render_output import (
    OutputKind,
    choose_output_kind,
    write_depths,
    write_pictures,
    write_video,
)
from quarc_ref.cli.render_plan import choose_planned_pictures, count_pictures, find_stop
from quarc_ref.cli.seekable_stream import open_seekable
from quarc_ref.cli.targets import reject_input_stream
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.viewing.paths.pose import PlannedPicture

_MAX_PIXELS = 6 << 20  # a 2.7K picture has 5.5 million; a malicious stream may declare any size


def render(
    file: StreamName,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="Output: a video (.mp4 or .webm), the picture of one frame (.png), or a folder of "
            "PNG files (a name without a suffix).",
        ),
    ],
    camera: Annotated[
        str | None,
        typer.Option(
            "--camera", metavar="NAME", help="Camera of the stream; default: the first camera."
        ),
    ] = None,
    to: Annotated[
        OutputKind | None,
        typer.Option(
            "--to",
            help="Type of output: an H.264 or VP9 video, PNG files, or NumPy archives of depth.",
            show_default="from PATH's suffix",
        ),
    ] = None,
    path: Annotated[
        str | None,
        typer.Option(
            "--path",
            metavar="orbit|spiral|interpolate|FILE",
            help="Move the camera: on a circle around the center of the scene (orbit), on a "
            "spiral in front of the scene (spiral), through the poses of all cameras "
            "(interpolate), or along the poses in a JSON file.",
            show_default="the camera does not move",
        ),
    ] = None,
    pictures: Annotated[
        int | None,
        typer.Option(
            "--pictures",
            min=1,
            max=1 << 20,
            metavar="N",
            help="Number of pictures, over which the frames are distributed evenly. Between "
            "frames, Gaussians are interpolated, except with --depth.",
            show_default="one per frame",
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option(
            "--fps",
            min=1.0,
            max=1000.0,
            help="Frames per second of the video. Without --pictures, the number of pictures is "
            "chosen so that the video lasts as long as the stream.",
            show_default="that of the stream",
        ),
    ] = None,
    depth: Annotated[
        bool,
        typer.Option(
            "--depth",
            help="Render depth into a folder of 16-bit PNG files or, with --to npz, float32 "
            "arrays; depth.json contains the scales and cameras.",
        ),
    ] = False,
    frames: Frames = None,
    width: Annotated[
        int | None,
        typer.Option("--width", min=1, help="Width in pixels; the height keeps the aspect ratio."),
    ] = None,
    max_pixels: Annotated[
        int,
        typer.Option(
            "--max-pixels",
            min=1,
            metavar="N",
            help="Reject pictures with more than N pixels, because a stream may declare any size.",
        ),
    ] = _MAX_PIXELS,
    pixel_format: Annotated[
        Literal["yuv444p", "yuv420p"] | None,
        typer.Option(
            "--pixels",
            help="Pixel format of a video: yuv444p keeps the color resolution, but browsers and "
            "many players do not support it.",
            show_default="yuv420p; yuv444p if width or height is odd",
        ),
    ] = None,
    background: Annotated[
        str | None,
        typer.Option(
            "--background",
            metavar="black|white|#RRGGBB|transparent",
            help="What is behind the scene; transparent writes PNG files with an alpha channel.",
            show_default="black",
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Render a stream from one of its cameras, as a video or a folder of PNG files.

    From a camera and in its own size, pictures are those that `eval` measures, rounded to 8 bits.
    Videos are encoded as H.264 with CRF 6, or as VP9 with CRF 12. With --path, the camera moves
    while the stream plays.
    """
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.rendering.pictures import render_depth
        from quarc_ref.streams import open_source
        from quarc_ref.viewing.draw_frames import draw_picture, draw_planned_pictures
        from quarc_ref.viewing.outline import outline_stream

        frame_range = parse_frames(frames)
        kind = choose_output_kind(output, to, depth=depth)
        background_color = parse_background(background)
        reject_conflicts(kind, depth, pixel_format, background)
        reject_input_stream(output, file)
        with open_source(file) as file_source, open_seekable(file_source) as source:
            outline = outline_stream(source)
            render_camera = choose_camera(outline, camera, width, kind)
            require_pixel_limit(render_camera, max_pixels)
            picture_count = count_pictures(outline, frame_range, pictures, fps)
            plan = choose_planned_pictures(outline, render_camera, frame_range, path, picture_count)
            draw: Callable[..., Any] = partial(draw_picture, background=background_color)
            if depth:  # only of frames, which depth.json names
                plan, draw = [replace(planned, share=0.0) for planned in plan], render_depth
            is_planned = path is not None or picture_count is not None
            stop = find_stop(outline, plan, frame_range, path)
            pictures_drawn = draw_planned_pictures(source, plan, draw, outline.cameras, stop)
            rendered: Iterator[Any] = _report_progress(pictures_drawn, progress, len(plan))
            if depth:
                result = write_depths(zip(plan, rendered, strict=True), output, kind, force=force)
            elif kind == "mp4" or kind == "webm":
                video_format = choose_video_format(outline, render_camera, pixel_format, kind, fps)
                result = write_video(enumerate(rendered), output, video_format, force=force)
            else:
                numbers = range(len(plan)) if is_planned else (item.frame for item in plan)
                pairs = zip(numbers, rendered, strict=True)
                result = write_pictures(pairs, output, force=force)
        _print_result(output, plan, path, result, kind, as_json=as_json)


def _report_progress(
    rendered: Iterator[Any], progress: TerminalProgress, total: int
) -> Iterator[Any]:
    """Yield the rendered pictures unchanged, and show progress."""
    for done_count, picture in enumerate(rendered, start=1):
        progress.advance("render", done_count, total)
        yield picture


def _print_result(
    output: Path,
    planned_pictures: "list[PlannedPicture]",
    path: str | None,
    result: dict[str, object],
    kind: OutputKind,
    *,
    as_json: bool,
) -> None:
    camera = planned_pictures[0].camera
    if as_json:
        camera_values = {"camera": camera.name, "width": camera.width, "height": camera.height}
        print_json("render/2", {**result, "path": path, **camera_values})
        return
    size = f"{camera.width} x {camera.height}"
    count = int(str(result["frames"]))
    if "folder" in result:
        fields = {"pictures": f"{format_count(count, f'{kind.upper()} file')} of {size}"}
    else:
        codec = "H.264" if kind == "mp4" else "VP9"
        fields = {"video": f"{format_count(count, 'frame')} of {size}, {codec}"}
    print_fields(str(output), fields | ({"path": path} if path else {"camera": camera.name}))
