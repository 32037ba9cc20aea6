"""The commands `synth`, which ray-traces a capture, and `demo`, which also encodes it."""

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import typer

from quarc_ref.cli.encoder_options import make_config
from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AsJson, Force, Quiet, Seed, Settings
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json
from quarc_ref.cli.targets import written_folder
from quarc_ref.cli.verbs.evaluate import print_evaluation
from quarc_ref.wording import format_count

VariantName = Literal[
    "playroom",
    "bright-stage",
    "dark-stage",
    "mixed-cameras",
    "auto-exposure",
    "fast",
    "visitor",
]
_VARIANT_HELP = (
    "playroom: a bright, detailed room; bright-stage: one small subject in an empty hall; "
    "dark-stage: the same subject and light in a black hall; mixed-cameras: cameras with "
    "different exposures and colors; auto-exposure: cameras whose exposures change over time; "
    "fast: all motion is three times as fast; visitor: an object that appears and disappears."
)


def synth(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to create.")],
    width: Annotated[int, typer.Option("--width", min=16, help="Width in pixels.")] = 160,
    height: Annotated[int, typer.Option("--height", min=16, help="Height in pixels.")] = 120,
    frames: Annotated[
        int, typer.Option("--frames", min=1, help="Number of frames, at 30 per second.")
    ] = 24,
    cameras: Annotated[
        int, typer.Option("--cameras", min=3, max=100, help="Number of cameras, including cam00.")
    ] = 13,
    variant: Annotated[
        VariantName, typer.Option("--variant", metavar="NAME", help=_VARIANT_HELP)
    ] = "playroom",
    masks: Annotated[
        bool,
        typer.Option(
            "--masks",
            help="Also write masks of the subject of a stage, and note that the background is "
            "transparent, so that only the subject is encoded.",
        ),
    ] = False,
    seed: Seed = 0,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Ray-trace a synthetic capture in N3DV's layout; cam00 is meant to be held out."""
    with report_errors():
        from quarc_ref.datasets.calibration import require_video_size
        from quarc_ref.synth import SynthOptions, fill_synthetic_capture

        try:
            require_video_size(width, height)
            options = SynthOptions(
                width,
                height,
                frames,
                seed=seed,
                cameras=cameras - 1,
                variant=variant,
                has_masks=masks,
            )
        except ValueError as error:
            raise UsageError(str(error)) from error
        with (
            TerminalProgress(quiet=quiet) as progress,
            written_folder(folder, force=force) as output_folder,
        ):
            fill_synthetic_capture(output_folder, options, partial(progress.advance, "synth"))
        if as_json:
            sizes = {"width": width, "height": height, "frames": frames, "cameras": cameras}
            print_json("synth/2", {"folder": str(folder), "variant": variant, **sizes})
        else:
            description = f"{format_count(frames, 'frame')} each, {width} x {height}"
            videos = f"{cameras} with {description}; cam00 should be held out"
            print_fields(str(folder), {"scene": variant, "videos": videos})


def demo(
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to create.")
    ],
    frames: Annotated[
        int, typer.Option("--frames", min=2, help="Number of frames, at 30 per second.")
    ] = 24,
    seed: Seed = 0,
    settings: Settings = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run the whole pipeline: ray-trace a capture, encode it, and measure the stream.

    The folder then contains the capture, the stream, a page that plays it, and a report.
    """
    with report_errors():
        config = make_config("demo", settings or [], seed)
        from quarc_ref.cli.demo_work import run_demo
        from quarc_ref.synth import SynthOptions

        options = SynthOptions(frames=frames, seed=seed)
        with (
            TerminalProgress(quiet=quiet) as progress,
            written_folder(output, force=force) as folder,
        ):
            demo_output = run_demo(folder, options, config, progress)
        stream_path, player_path, report_path = (
            output / path.relative_to(folder.path) for path in demo_output.paths
        )
        pages = {"player": player_path, "report": report_path}
        print_evaluation("demo/5", stream_path, demo_output.evaluation, pages, as_json=as_json)
