"""The verb `render`: what a camera of a stream sees, as a video or as pictures."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AsJson, Force, Frames, Quiet, StreamName, parse_frames
from quarc_ref.cli.output import TerminalProgress, print_json, print_table
from quarc_ref.cli.render_choices import choose_camera, choose_form, require_pixels
from quarc_ref.cli.seekable_stream import seekable_stream
from quarc_ref.cli.targets import written_file, written_folder, written_frame

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Image
    from quarc_ref.datasets.video_writer import VideoForm
    from quarc_ref.format.cameras import Camera
    from quarc_ref.streams import Source

    _Pictures = Iterator[tuple[int, Image]]

_ONE_PICTURE = ".png"
_MOST_PIXELS = 6 << 20  # 2.7K has 5.5 million; a stream may name any size at no cost in bytes


def render(
    file: StreamName,
    output: Annotated[
        Path,
        typer.Option(
            "--output",
            "-o",
            metavar="PATH",
            help="What to make: .mp4 is a video, .png the picture of one frame, a name without a "
            "suffix a folder of PNG files.",
        ),
    ],
    camera: Annotated[
        str | None,
        typer.Option(
            "--camera", metavar="NAME", help="A camera of the stream; the first by default."
        ),
    ] = None,
    to: Annotated[
        Literal["mp4", "png"] | None,
        typer.Option(
            "--to",
            help="An H.264 video, or a PNG per frame, whatever PATH's name.",
            show_default="as PATH's name ends",
        ),
    ] = None,
    frames: Frames = None,
    width: Annotated[
        int | None,
        typer.Option("--width", min=1, help="Pixels, the camera's by default; height in step."),
    ] = None,
    max_pixels: Annotated[
        int,
        typer.Option(
            "--max-pixels",
            min=1,
            metavar="N",
            help="Reject larger pictures: a camera of a stream may ask for any size.",
        ),
    ] = _MOST_PIXELS,
    pixels: Annotated[
        Literal["yuv444p", "yuv420p"] | None,
        typer.Option(
            "--pixels",
            help="Of a video: yuv420p halves the detail of colors, and plays anywhere.",
            show_default="yuv444p",
        ),
    ] = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Draw what a camera of a stream sees, as `eval` does: a video, or a folder of PNG files.

    Pictures are rounded to 8 bits and otherwise exact; a video is H.264 at CRF 6.
    """
    with report_errors(), TerminalProgress(quiet=quiet) as progress:
        from quarc_ref.streams import open_source
        from quarc_ref.viewing.outline import outline_stream

        wanted = parse_frames(frames)
        kind = to or _choose_kind(output)
        if kind == "png" and pixels:
            message = "PNG files do not go with --pixels"
            raise UsageError(message)
        with open_source(file) as opened, seekable_stream(opened) as source:
            outline = outline_stream(source)
            eye = choose_camera(outline, camera, width, kind)
            require_pixels(eye, max_pixels)
            drawn = _draw(source, eye, wanted, progress, outline.count_frames(*wanted))
            if kind == "mp4":
                form = choose_form(outline, eye, pixels or "yuv444p")
                made = _write_video(drawn, output, form, force=force)
            else:
                made = _write_pictures(drawn, output, force=force)
        _show(output, eye, made, as_json=as_json)


def _choose_kind(output: Path) -> Literal["mp4", "png"]:
    """Return what a name is for, where --to does not say it."""
    suffix = output.suffix.lower()
    if suffix == ".mp4":
        return "mp4"
    if suffix not in ("", _ONE_PICTURE):
        message = (
            f"{output} has a name neither for a video, which ends in .mp4, nor for the picture of "
            "one frame, which ends in .png, nor for a folder of PNG files, without a suffix: "
            "--to mp4 or --to png says which it is to be"
        )
        raise UsageError(message)
    return "png"


def _draw(
    source: "Source",
    camera: "Camera",
    wanted: tuple[int, int | None],
    progress: TerminalProgress,
    total: int,
) -> "_Pictures":
    """Yield the pictures wanted, of which there must be one."""
    from quarc_ref.viewing.draw_frames import draw_frames

    drawn = draw_frames(source, camera, *wanted)
    picture = next(drawn, None)
    if picture is None:
        message = "the stream holds none of the frames asked for"
        raise UsageError(message)
    done = 0
    while picture is not None:
        done += 1
        progress.advance("render", done, total)
        yield picture
        picture = next(drawn, None)


def _write_video(
    drawn: "_Pictures", output: Path, form: "VideoForm", *, force: bool
) -> dict[str, object]:
    from quarc_ref.datasets.video_writer import write_mp4

    with written_file(output, force=force) as sink:
        count = write_mp4(sink, (picture for _, picture in drawn), form)
    return {"file": str(output), "frames": count, "bytes": output.stat().st_size}


def _write_pictures(drawn: "_Pictures", output: Path, *, force: bool) -> dict[str, object]:
    from quarc_ref.datasets.video_writer import build_png

    one = output.suffix.lower() == _ONE_PICTURE
    with (written_frame if one else written_folder)(output, force=force) as target:
        names = [
            target.write(f"frame_{frame:04}.png", build_png(picture)).name
            for frame, picture in drawn
        ]
    folder = output.parent if one else output
    return {"folder": str(folder), "frames": len(names), "files": names}


def _show(output: Path, camera: "Camera", made: dict[str, object], *, as_json: bool) -> None:
    if as_json:
        seen = {"camera": camera.name, "width": camera.width, "height": camera.height}
        print_json("render/1", made | seen)
        return
    size = f"{camera.width} x {camera.height}"
    plural = "" if made["frames"] == 1 else "s"
    if "folder" in made:
        lines = {"pictures": f"{made['frames']} PNG file{plural} of {size}"}
    else:
        lines = {"video": f"{made['frames']} frame{plural} of {size}, H.264"}
    print_table(str(output), lines | {"camera": camera.name})
