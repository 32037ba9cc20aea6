"""Options of the `encode` command, and checks of their combinations."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from quarc_ref.cli.completion import complete_preset
from quarc_ref.cli.encoder_options import print_settings
from quarc_ref.cli.errors import UsageError, report_errors

_PRESET_HELP = (
    "main: best quality for its size; demo: faster, for a preview, at more KB per frame; "
    "paper: training schedule and quantization steps of the QuARC-GS paper."
)


def _list_settings(is_requested: bool) -> None:
    if is_requested:
        with report_errors():
            print_settings()
        raise typer.Exit


Output = Annotated[
    Path,
    typer.Option("--output", "-o", metavar="FILE", help="Stream to write; - for standard output."),
]
FrameCount = Annotated[
    int | None,
    typer.Option("--frames", min=1, help="Number of frames to encode.", show_default="all"),
]
Start = Annotated[int, typer.Option("--start", min=0, help="First frame of the capture to encode.")]
Downscale = Annotated[
    int, typer.Option("--downscale", min=1, help="Downscale the pictures by this factor.")
]
Preset = Annotated[str, typer.Option("--preset", help=_PRESET_HELP, autocompletion=complete_preset)]
ListSettings = Annotated[
    bool,
    typer.Option(
        "--list-settings",
        help="Print all settings with their ranges, descriptions and values in each preset.",
        is_eager=True,
        callback=_list_settings,
    ),
]
FormatVersion = Annotated[
    Literal["1.0", "1.1"],
    typer.Option(
        "--format",
        help="Format version: 1.1 allows updates of individual Gaussians; 1.0 is for decoders "
        "that do not support 1.1.",
    ),
]
KeyframeInterval = Annotated[
    int | None,
    typer.Option(
        "--keyframe-interval",
        min=1,
        metavar="N",
        help="Make every N-th frame a keyframe (a canonical frame), at which decoding, cut and "
        "join can start.",
        show_default="only frame 0",
    ),
]
SnapshotInterval = Annotated[
    int | None,
    typer.Option(
        "--snapshot-interval",
        min=1,
        metavar="N",
        help="Make every N-th frame a snapshot, which serves as a keyframe but has about a third "
        "of the size; not available in format 1.0.",
        show_default="none",
    ),
]
QualityLevel = Annotated[
    float | None,
    typer.Option(
        "--quality",
        metavar="Q",
        help="Quality from 0 to 100; an increase of 20 halves the weight of bytes (--lambda).",
        show_default="50",
    ),
]
Lambda = Annotated[
    float | None,
    typer.Option(
        "--lambda",
        metavar="X",
        help="Rate-distortion lambda, relative to the preset. A larger lambda means fewer bytes "
        "and lower quality.",
        show_default="1",
    ),
]
TargetSize = Annotated[
    float | None,
    typer.Option(
        "--target-kb-per-frame",
        metavar="K",
        help="Target for the mean size, in KB (1024 bytes), of the frames that are not keyframes; "
        "lambda is adapted from frame to frame.",
        show_default="no target",
    ),
]
HeldOut = Annotated[
    list[str] | None,
    typer.Option(
        "--held-out",
        metavar="NAME",
        help="Camera to hold out from training and use in eval; may be repeated.",
        show_default="the first",
    ),
]
Device = Annotated[
    Literal["auto", "cpu", "cuda"], typer.Option("--device", help="Device to train on.")
]
Live = Annotated[
    bool,
    typer.Option(
        "--live",
        help="Write to FILE directly, so that other programs can read it during the encode.",
    ),
]
Resume = Annotated[
    bool,
    typer.Option(
        "--resume",
        help="Resume an interrupted encode with the same settings; on the same kind of CPU, the "
        "output is byte-identical.",
    ),
]
Segments = Annotated[
    int | None,
    typer.Option(
        "--segments",
        min=1,
        metavar="K",
        help="Split the frames into K segments, encode them in parallel, and join them.",
        show_default="one stream",
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(
        "--workers",
        min=1,
        help="Number of segments to encode at the same time on this machine.",
        show_default="one per CPU core",
    ),
]
RayAddress = Annotated[
    str | None,
    typer.Option(
        "--ray",
        metavar="ADDRESS",
        help="Encode segments on a Ray cluster: host:port, or auto. With --device cuda, each "
        "segment reserves a GPU; otherwise, none does.",
    ),
]
NoChecks = Annotated[
    bool,
    typer.Option(
        "--no-checks",
        help="Do not check cameras, poses and points before encoding.",
    ),
]
LogFile = Annotated[
    Path | None,
    typer.Option(
        "--log-json",
        metavar="FILE",
        help="Write a JSON line to FILE after each training step and each frame; with --resume, "
        "append to an existing FILE.",
    ),
]
TensorBoardFolder = Annotated[
    Path | None,
    typer.Option(
        "--tensorboard", metavar="DIR", help="Write losses, PSNR and sizes for TensorBoard."
    ),
]


def reject_conflicts(option_name: str, is_given_by_option: dict[str, bool]) -> None:
    """Raise UsageError if an option is given that conflicts with `option_name`."""
    for option, is_given in is_given_by_option.items():
        if is_given:
            message = f"{option_name} cannot be combined with {option}"
            raise UsageError(message)


def reject_segment_options(is_given_by_option: dict[str, bool]) -> None:
    """Raise UsageError if an option is given that needs `--segments`."""
    for option, is_given in is_given_by_option.items():
        if is_given:
            message = f"{option} needs --segments"
            raise UsageError(message)
