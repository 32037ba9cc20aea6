"""The main job once, on the built-in capture: trace, encode, decode, measure, report."""

from dataclasses import dataclass
from pathlib import Path

from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.datasets.synth import SynthOptions, write_synthetic_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.config import EncoderConfig
from quarc_ref.encoder.progress import Progress
from quarc_ref.evaluation.evaluate import Evaluation, evaluate_stream
from quarc_ref.evaluation.report import write_report


@dataclass(frozen=True, slots=True, eq=False)
class Demo:
    """What a demo has made.

    Attributes:
        stream: The stream's file.
        report: The report's page.
        evaluation: What the report shows.
    """

    stream: Path
    report: Path
    evaluation: Evaluation


def run_demo(
    folder: Path, options: SynthOptions, config: EncoderConfig, progress: Progress
) -> Demo:
    """Make a capture, a stream and a report in a folder.

    Args:
        folder: Exists.
        options: Of the capture.
        config: Of the encoder.
        progress: Is told of every step.
    """
    capture = folder / "capture"
    write_synthetic_capture(
        capture, options, lambda done, total: progress.advance("synth", done, total)
    )
    stream = folder / "demo.quarc"
    with stream.open("wb") as sink:
        encode(open_capture(capture), sink, EncodeOptions(config, progress=progress))
    evaluation = evaluate_stream(stream.read_bytes(), capture, progress.advance)
    return Demo(stream, write_report(evaluation, folder / "report"), evaluation)
