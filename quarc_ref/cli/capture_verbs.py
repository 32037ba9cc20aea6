"""The verbs that read or make a capture beside `encode`: eval, synth, demo."""

from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import partial
from pathlib import Path
from statistics import mean
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from quarc_ref.cli.encoder_options import configure
from quarc_ref.cli.faults import UsageError, regain_signals, reported_faults
from quarc_ref.cli.options import (
    AsJson,
    CaptureFolder,
    Force,
    Quiet,
    Seed,
    Settings,
    StreamFile,
)
from quarc_ref.cli.output import TerminalProgress, print_json, print_table, tell
from quarc_ref.cli.stream_verbs import describe
from quarc_ref.cli.targets import written_folder

if TYPE_CHECKING:
    from quarc_ref.evaluation.evaluate import Evaluation
    from quarc_ref.evaluation.protocol import Protocol

VariantName = Literal["playroom", "bright-stage", "dark-stage", "mixed-cameras", "fast", "visitor"]
_VARIANT_HELP = (
    "playroom: a bright, detailed room; bright-stage: one small subject in an empty hall; "
    "dark-stage: the same subject, light and hall, but black; "
    "mixed-cameras: cameras of different exposures and colors; "
    "fast: everything three times as fast; visitor: something that appears and leaves."
)


def evaluate(
    file: StreamFile,
    capture: CaptureFolder,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="DIR", help="Write a page with pictures.")
    ] = None,
    other_capture: Annotated[
        bool,
        typer.Option(
            "--other-capture", help="Measure also a stream that was made from another capture."
        ),
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Measure a stream on the held-out cameras, decoded from the file."""
    with reported_faults():
        from quarc_ref.evaluation.evaluate import evaluate_stream

        regain_signals()
        target = written_folder(report, force=force) if report else nullcontext()
        with TerminalProgress(quiet=quiet) as progress, target as folder:
            with _refused(file, as_json=as_json):
                data = Path(file).read_bytes()
                evaluation = evaluate_stream(
                    data, capture, progress.advance, other_capture=other_capture
                )
            if folder:
                from quarc_ref.evaluation.report import write_report

                write_report(evaluation, folder)
        _warn_of_other_capture(evaluation.protocol)
        page = report / "index.html" if report else None
        _show_evaluation("eval/1", Path(file), evaluation, page, as_json=as_json)


@contextmanager
def _refused(file: str, *, as_json: bool) -> Iterator[None]:
    """Turn a capture that does not belong to a stream into a fault of the command line."""
    from quarc_ref.evaluation.evaluate import MismatchError, OtherCaptureError

    try:
        yield
    except OtherCaptureError as error:
        if as_json:
            captures = {"fingerprint": error.fingerprint, "encoded_from": error.encoded_from}
            print_json("eval-refused/1", {"file": file, "same_capture": False, **captures})
        message = f"{error}: --other-capture measures it all the same"
        raise UsageError(message) from error
    except MismatchError as error:
        raise UsageError(str(error)) from error


def _warn_of_other_capture(protocol: "Protocol") -> None:
    if protocol.same_capture is None:
        tell("the stream has no fingerprint: whether it was made from this capture is unknown")
    elif not protocol.same_capture:
        tell(f"the stream was made from another capture, of fingerprint {protocol.encoded_from}")


def synth(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder to make.")],
    width: Annotated[int, typer.Option("--width", min=16, help="Pixels.")] = 160,
    height: Annotated[int, typer.Option("--height", min=16, help="Pixels.")] = 120,
    frames: Annotated[int, typer.Option("--frames", min=1, help="Frames, 30 a second.")] = 24,
    cameras: Annotated[
        int, typer.Option("--cameras", min=3, max=100, help="Cameras, cam00 among them.")
    ] = 13,
    variant: Annotated[
        VariantName, typer.Option("--variant", metavar="NAME", help=_VARIANT_HELP)
    ] = "playroom",
    seed: Seed = 0,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Ray-trace a synthetic capture in N3DV's layout, of which cam00 is to be held out."""
    with reported_faults():
        from quarc_ref.datasets.calibration import require_video_size
        from quarc_ref.datasets.synth import SynthOptions, fill_synthetic_capture

        try:
            require_video_size(width, height)
            options = SynthOptions(
                width, height, frames, seed=seed, cameras=cameras - 1, variant=variant
            )
        except ValueError as error:
            raise UsageError(str(error)) from error
        with (
            TerminalProgress(quiet=quiet) as progress,
            written_folder(folder, force=force) as made,
        ):
            fill_synthetic_capture(made, options, partial(progress.advance, "synth"))
        if as_json:
            sizes = {"width": width, "height": height, "frames": frames, "cameras": cameras}
            print_json("synth/2", {"folder": str(folder), "variant": variant, **sizes})
        else:
            each = f"{frames} frame{'' if frames == 1 else 's'} each, {width} x {height}"
            videos = f"{cameras}, of {each}; cam00 is to be held out"
            print_table(str(folder), {"scene": variant, "videos": videos})


def demo(
    output: Annotated[Path, typer.Option("--output", "-o", metavar="DIR", help="Folder to make.")],
    frames: Annotated[int, typer.Option("--frames", min=2, help="Frames, 30 a second.")] = 24,
    seed: Seed = 0,
    settings: Settings = None,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Do it all once: trace a capture, encode it, decode and measure it, write a report."""
    with reported_faults():
        config = configure("demo", settings or [], seed)
        from quarc_ref.datasets.synth import SynthOptions
        from quarc_ref.evaluation.demo import run_demo

        regain_signals()
        options = SynthOptions(frames=frames, seed=seed)
        with (
            TerminalProgress(quiet=quiet) as progress,
            written_folder(output, force=force) as folder,
        ):
            made = run_demo(folder, options, config, progress)
        page = output / made.report.relative_to(folder.path)
        _show_evaluation(
            "demo/1", output / made.stream.name, made.evaluation, page, as_json=as_json
        )


def _show_evaluation(
    schema: str, file: Path, evaluation: "Evaluation", page: Path | None, *, as_json: bool
) -> None:
    summary, quality = evaluation.summary, evaluation.quality
    if as_json:
        report = {} if page is None else {"report": str(page)}
        protocol = evaluation.protocol
        measured = {
            **quality.as_json(),
            "same_capture": protocol.same_capture,
            "protocol": protocol.as_json(),
        }
        print_json(schema, {"file": str(file), **summary.as_json(), **measured, **report})
        return
    lines = {
        "PSNR, held out": f"{mean(quality.psnr):.2f} dB; first frame {quality.psnr[0]:.2f}, "
        f"worst {min(quality.psnr):.2f}",
        "SSIM, held out": f"{mean(quality.ssim):.4f} (ssim_inria)",
    }
    if page is not None:
        lines["report"] = str(page)
    print_table(file.name, describe(summary) | lines)
