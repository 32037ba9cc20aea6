"""Runs the `demo` command: ray-traces a capture, encodes it, and measures the stream."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.progress import Progress
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.evaluation.evaluate import Evaluation, evaluate_stream
from quarc_ref.evaluation.report import write_report
from quarc_ref.files import OutputFolder
from quarc_ref.synth import SynthOptions, fill_synthetic_capture


@dataclass(frozen=True, slots=True, eq=False)
class DemoOutput:
    """Outputs of a demo.

    Attributes:
        stream_path: Path of the stream.
        report_path: Path of the report page.
        evaluation: Measurements shown in the report.
    """

    stream_path: Path
    report_path: Path
    evaluation: Evaluation


def run_demo(
    folder: OutputFolder, options: SynthOptions, config: EncoderConfig, progress: Progress
) -> DemoOutput:
    """Write a capture, a stream and a report into a folder.

    Args:
        folder: Output folder.
        options: Options for ray-tracing the capture.
        config: Settings of the encoder.
        progress: Callback for the progress of every step.
    """
    with folder.create_subfolder("capture") as subfolder:
        fill_synthetic_capture(subfolder, options, partial(progress.advance, "synth"))
    capture_path, stream_path = folder.path / "capture", folder.path / "demo.quarc"
    with folder.open(stream_path.name) as sink:
        encode(open_capture(capture_path), sink, EncodeOptions(config, progress=progress))
    evaluation = evaluate_stream(stream_path.read_bytes(), capture_path, progress.advance)
    with folder.create_subfolder("report") as subfolder:
        return DemoOutput(stream_path, write_report(evaluation, subfolder), evaluation)
