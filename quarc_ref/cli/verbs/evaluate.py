"""The `eval` command: measures a stream on the held-out cameras."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import (
    AsJson,
    CaptureFolder,
    Force,
    Frames,
    LpipsWeights,
    Quiet,
    StreamFile,
    parse_frames,
)
from quarc_ref.cli.output import (
    TerminalProgress,
    print_columns,
    print_fields,
    print_json,
    print_message,
)
from quarc_ref.cli.perceptual import load_lpips
from quarc_ref.cli.targets import reject_input_folder, written_folder
from quarc_ref.cli.verbs.stream import describe_stream

if TYPE_CHECKING:
    from quarc_ref.evaluation.evaluate import Evaluation
    from quarc_ref.evaluation.protocol import Protocol
    from quarc_ref.evaluation.quality import Quality


def evaluate(
    file: StreamFile,
    capture: CaptureFolder,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="DIR", help="Write a report with pictures.")
    ] = None,
    frames: Frames = None,
    lpips: LpipsWeights = None,
    other_capture: Annotated[
        bool,
        typer.Option(
            "--other-capture", help="Measure the stream even if it was made from another capture."
        ),
    ] = False,
    as_json: AsJson = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Decode a stream and measure its quality on the held-out cameras."""
    with report_errors():
        from quarc_ref.evaluation.evaluate import EvaluationOptions, evaluate_stream

        if report is not None:
            reject_input_folder(report, (capture, Path(file)))
        options = EvaluationOptions(parse_frames(frames), load_lpips(lpips), other_capture)
        target = written_folder(report, force=force) if report else nullcontext()
        with TerminalProgress(quiet=quiet) as progress, target as folder:
            with _convert_mismatch_errors(file, as_json=as_json):
                data = Path(file).read_bytes()
                evaluation = evaluate_stream(data, capture, progress.advance, options)
            if folder:
                from quarc_ref.evaluation.report import write_report

                write_report(evaluation, folder)
        _warn_about_other_capture(evaluation.protocol)
        _report_equal_views(evaluation.quality)
        pages = {"report": report / "index.html"} if report else {}
        print_evaluation("eval/5", Path(file), evaluation, pages, as_json=as_json)


@contextmanager
def _convert_mismatch_errors(file: str, *, as_json: bool) -> Iterator[None]:
    """Convert errors about a capture that does not match the stream to UsageError."""
    from quarc_ref.evaluation.same_capture import MismatchError, OtherCaptureError

    try:
        yield
    except OtherCaptureError as error:
        if as_json:
            fingerprints = {"fingerprint": error.fingerprint, "encoded_from": error.encoded_from}
            print_json("eval-refused/1", {"file": file, "same_capture": False, **fingerprints})
        message = f"{error}: use --other-capture to measure the stream anyway"
        raise UsageError(message) from error
    except MismatchError as error:
        raise UsageError(str(error)) from error


def _warn_about_other_capture(protocol: "Protocol") -> None:
    from quarc_ref.evaluation.same_capture import describe_doubt

    doubt = describe_doubt(protocol.encoded_from, protocol.fingerprint)
    if doubt:
        print_message(doubt)


def _report_equal_views(quality: "Quality") -> None:
    from quarc_ref.evaluation.metrics import MAX_DECIBELS

    equal_count, view_count = quality.count_views_at_max_psnr()
    if equal_count:
        print_message(
            f"the stream equals the truth in {equal_count} of {view_count} views; each of them "
            f"counts as {MAX_DECIBELS:g} dB"
        )


def print_evaluation(
    schema: str, file: Path, evaluation: "Evaluation", pages: Mapping[str, Path], *, as_json: bool
) -> None:
    """Print an evaluation as JSON or as text.

    Args:
        schema: Name and version of the JSON schema, such as `eval/5`.
        file: Path of the stream.
        evaluation: Measurements of the stream.
        pages: Paths of the written pages by their names in the output, such as `report`.
        as_json: Whether to print JSON.
    """
    from quarc_ref.evaluation.comparison.common_frames import format_frames

    summary, quality = evaluation.summary, evaluation.quality
    page_names = {name: str(path) for name, path in pages.items()}
    if as_json:
        protocol = evaluation.protocol
        quality_values = {
            **quality.as_json(evaluation.frames),
            "same_capture": protocol.is_same_capture,
            "protocol": protocol.as_json(),
        }
        print_json(schema, {"file": str(file), **summary.as_json(), **quality_values, **page_names})
        return
    frames, mean = evaluation.frames, quality.mean()
    fields = {
        "measured frames": format_frames(frames),
        "PSNR, held out": f"{mean['psnr']:.2f} dB; frame {frames[0]} {quality.psnr[0]:.2f}, "
        f"worst {min(quality.psnr):.2f}",
        "SSIM, held out": f"{mean['ssim']:.4f} (ssim_inria)",
    }
    print_fields(file.name, describe_stream(summary) | fields | page_names)
    headings = ["<camera", *quality.headings()]
    print_columns("Held-out cameras (cc: color-corrected)", headings, quality.as_rows())
