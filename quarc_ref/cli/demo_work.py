"""Runs the `demo` command: ray-traces a capture, encodes it, and measures and shows the stream."""

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
from quarc_ref.streams import BytesSource
from quarc_ref.synth import SynthOptions, fill_synthetic_capture
from quarc_ref.viewing.outline import find_camera, read_cameras
from quarc_ref.viewing.page import PageOptions, build_single_page
from quarc_ref.viewing.poster import draw_poster


@dataclass(frozen=True, slots=True, eq=False)
class DemoOutput:
    """Outputs of a demo.

    Attributes:
        paths: Paths of the stream, of the page that plays it, and of the report page.
        evaluation: Measurements shown in the report.
    """

    paths: tuple[Path, Path, Path]
    evaluation: Evaluation


def run_demo(
    folder: OutputFolder, options: SynthOptions, config: EncoderConfig, progress: Progress
) -> DemoOutput:
    """Write a capture, a stream, a page that plays it, and a report into a folder.

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
    stream = stream_path.read_bytes()
    page_path = folder.write("demo.html", _build_page(stream))
    evaluation = evaluate_stream(stream, capture_path, progress.advance)
    with folder.create_subfolder("report") as subfolder:
        report_path = write_report(evaluation, subfolder)
    return DemoOutput((stream_path, page_path, report_path), evaluation)


def _build_page(stream: bytes) -> bytes:
    """Build a page that contains the player and a stream with cameras."""
    source = BytesSource(stream)
    camera = find_camera(read_cameras(source) or (), None)
    options = PageOptions("quarc-ref demo", autoplay=True, loop=True)
    return build_single_page(options, stream, draw_poster(source, camera))
