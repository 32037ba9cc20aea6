"""Quality of a stream on the held-out cameras, from the decoded file and nothing else."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.camera_group import CameraGroup
from quarc_ref.evaluation.protocol import Protocol, describe_protocol
from quarc_ref.evaluation.quality import Quality
from quarc_ref.evaluation.same_capture import open_same_capture
from quarc_ref.evaluation.views import View
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import StreamSummary
from quarc_ref.streams import decode


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """A stream measured.

    Attributes:
        summary: What it is made of.
        quality: Its metrics.
        shown: Views of the first held-out camera: first, middle and last frame.
        protocol: Under what conditions.
    """

    summary: StreamSummary
    quality: Quality
    shown: tuple[View, ...]
    protocol: Protocol


def evaluate_stream(
    data: bytes,
    folder: Path,
    note: Callable[[str, int, int], None],
    *,
    other_capture: bool = False,
) -> Evaluation:
    """Measure a stream against the capture that it was made from.

    Args:
        data: A stream.
        folder: The capture.
        note: Is told of every frame: stage, done, total.
        other_capture: Whether to measure it on another capture of the same cameras and
            sizes as well. A stream that names no capture is measured on any such one.

    Raises:
        BitstreamError: What is wrong with the bytes.
        OtherCaptureError: The stream was made from another capture.
        MismatchError: The stream cannot be measured on the capture.
        CaptureError: The capture cannot be read.
    """
    summary = inspect_stream(data, note)
    capture = open_same_capture(summary, folder, other_capture=other_capture)
    count = len(summary.frames)
    group = CameraGroup(capture, summary.cameras, capture.held_out)
    shown = []
    for index, scene in enumerate(decode(data)):
        views = group.measure(dequantize(scene), scene.frame)
        if index in {0, count // 2, count - 1}:
            shown.append(views[0])
        note("evaluate", index + 1, count)
    made_from = summary.metadata.get("fingerprint")
    protocol = describe_protocol(capture, summary.cameras, count, summary.header.seed, made_from)
    return Evaluation(summary, group.quality, tuple(shown), protocol)
