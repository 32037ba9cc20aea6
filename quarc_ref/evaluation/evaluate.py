"""Measures the quality of a decoded stream on the held-out cameras."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.camera_group import CameraGroup
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.protocol import Protocol, make_protocol
from quarc_ref.evaluation.quality import Quality
from quarc_ref.evaluation.same_capture import MismatchError, open_same_capture
from quarc_ref.evaluation.views import View
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import StreamSummary
from quarc_ref.streams import decode


@dataclass(frozen=True, slots=True, eq=False)
class EvaluationOptions:
    """Options of an evaluation.

    Attributes:
        span: First frame and end frame (exclusive); an end of None includes all later frames.
        lpips: LPIPS metric; None to omit it.
        accept_other_capture: Whether to accept a stream that was encoded from another capture with
            the same cameras and picture sizes. A stream without a fingerprint is always accepted.
    """

    span: tuple[int, int | None] = (0, None)
    lpips: Lpips | None = None
    accept_other_capture: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Evaluation:
    """Measurements of a stream.

    Attributes:
        summary: Summary of the stream.
        quality: Metrics of all measured cameras and frames.
        frames: Ordinals of the measured frames.
        shown_views: View of the first, middle and last frame of the first held-out camera whose
            picture of that frame is used.
        protocol: Conditions of the measurement.
    """

    summary: StreamSummary
    quality: Quality
    frames: tuple[int, ...]
    shown_views: tuple[View, ...]
    protocol: Protocol


def evaluate_stream(
    data: bytes,
    folder: Path,
    on_progress: Callable[[str, int, int], None],
    options: EvaluationOptions = EvaluationOptions(),
) -> Evaluation:
    """Measure a stream on the capture from which it was encoded.

    Args:
        data: Bytes of the stream.
        folder: Folder of the capture.
        on_progress: Called after every inspected or measured frame with the name of the stage, the
            number of finished frames and the total number of frames.
        options: Frames and metrics to measure.

    Raises:
        BitstreamError: The stream is malformed.
        OtherCaptureError: The stream was encoded from another capture.
        MismatchError: The stream cannot be measured on the capture, or has no frames in the span.
        CaptureError: The capture cannot be read.
    """
    summary = inspect_stream(data, on_progress)
    if summary.cameras and not any(camera.held_out for camera in summary.cameras):
        message = "the stream has no held-out cameras, so there is nothing to measure"
        raise MismatchError(message)
    capture = open_same_capture(
        summary,
        folder,
        stop=options.span[1],
        accept_other_capture=options.accept_other_capture,
    )
    frames = _list_frames(summary, capture, options.span)
    frame_count = len(frames)
    camera_group = CameraGroup(capture, summary.cameras, capture.held_out, lpips=options.lpips)
    shown_views = []
    scenes = (scene for scene in decode(data, *options.span) if scene.frame in frames)
    for index, scene in enumerate(scenes):
        views = camera_group.measure(dequantize(scene), scene.frame)
        if index in {0, frame_count // 2, frame_count - 1}:
            shown_views.append(views[0])
        on_progress("evaluate", index + 1, frame_count)
    encoded_from = summary.metadata.get("fingerprint")
    protocol = replace(
        make_protocol(capture, summary.cameras, frames, summary.header.seed, encoded_from),
        metrics=camera_group.variants,
    )
    return Evaluation(summary, camera_group.quality, frames, tuple(shown_views), protocol)


def _list_frames(
    summary: StreamSummary, capture: Capture, span: tuple[int, int | None]
) -> tuple[int, ...]:
    """Return the frames of a stream within a span that a held-out camera of the capture shows.

    Raises:
        MismatchError: There are no such frames.
    """
    start, stop = span
    frames = tuple(
        frame.frame
        for frame in summary.frames
        if start <= frame.frame and (stop is None or frame.frame < stop)
    )
    if not frames:
        first_frame, last_frame = summary.frames[0].frame, summary.frames[-1].frame
        message = (
            f"the stream has no frames in this range; its frames are {first_frame} to {last_frame}"
        )
        raise MismatchError(message)
    shown_frames = tuple(
        frame for frame in frames if any(capture.is_used(i, frame) for i in capture.held_out)
    )
    if not shown_frames:
        message = f"{NOTES_NAME} ignores these frames of all held-out cameras"
        raise MismatchError(message)
    return shown_frames
