"""Opens the capture that a stream was made from, at the stream's size."""

import re
from collections.abc import Sequence
from itertools import zip_longest
from pathlib import Path

from quarc_ref.datasets.calibration import DownscaleError
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.format.cameras import Camera
from quarc_ref.inspection.stream_summary import StreamSummary

_FEW = 12  # digits that are enough to distinguish fingerprints


class MismatchError(ValueError):
    """A stream and a capture do not match."""


class OtherCaptureError(MismatchError):
    """A stream could be measured on a capture, but was made from another one.

    Attributes:
        fingerprint: Fingerprint of the capture.
        encoded_from: Fingerprint in the stream.
    """

    def __init__(self, fingerprint: str, encoded_from: str) -> None:
        self.fingerprint, self.encoded_from = fingerprint, encoded_from
        theirs, ours = encoded_from[:_FEW], fingerprint[:_FEW]
        super().__init__(
            f"the stream was made from another capture, with fingerprint {theirs}...; "
            f"the fingerprint of this capture is {ours}..."
        )


def open_same_capture(
    summary: StreamSummary, folder: Path, *, other_capture: bool = False
) -> Capture:
    """Open the capture of a stream at the stream's size, with its cameras held out.

    Args:
        summary: Summary of the stream.
        folder: Folder of the capture.
        other_capture: Whether to accept another capture with the same cameras and sizes.

    Raises:
        OtherCaptureError: The stream was made from another capture.
        MismatchError: The stream cannot be measured on the capture.
        CaptureError: The capture cannot be read.
    """
    held_out = tuple(camera.name for camera in summary.cameras if camera.held_out)
    if not held_out or not summary.frames:
        missing = "frame" if held_out else "held-out camera"
        message = f"the stream has no {missing}, so there is nothing to measure"
        raise MismatchError(message)
    start = _read_start(summary)
    full = open_capture(folder, CaptureOptions(start=start))
    _require_equal("cameras", _names(full.cameras), _names(summary.cameras))
    downscale = max(1, round(full.cameras[0].width / summary.cameras[0].width))
    try:
        options = CaptureOptions(downscale, held_out, start=start)
        capture = open_capture(folder, options)
    except DownscaleError as error:
        raise MismatchError(str(error)) from error
    _require_equal("picture sizes", _sizes(capture.cameras), _sizes(summary.cameras))
    if capture.frame_count <= summary.frames[-1].frame:
        message = (
            f"frame {summary.frames[-1].frame} of the stream is not in the capture, "
            f"which has {capture.frame_count} frames"
        )
        raise MismatchError(message)
    made_from = summary.metadata.get("fingerprint", capture.fingerprint)
    if made_from != capture.fingerprint and not other_capture:
        raise OtherCaptureError(capture.fingerprint, made_from)
    return capture


def _read_start(summary: StreamSummary) -> int:
    """Return the frame of the capture that is frame 0 of the stream.

    Raises:
        MismatchError: `start` in the stream's metadata is not a frame number.
    """
    text = summary.metadata.get("start", "0")
    if not re.fullmatch(r"[0-9]{1,9}", text):
        message = f"the metadata 'start' of the stream is {text!r}, not a frame number"
        raise MismatchError(message)
    return int(text)


def _require_equal(subject: str, of_capture: Sequence[str], of_stream: Sequence[str]) -> None:
    for ours, theirs in zip_longest(of_capture, of_stream, fillvalue="none"):
        if ours != theirs:
            message = f"{subject} differ: {ours} in the capture, {theirs} in the stream"
            raise MismatchError(message)


def _names(cameras: Sequence[Camera]) -> list[str]:
    return [camera.name for camera in cameras]


def _sizes(cameras: Sequence[Camera]) -> list[str]:
    return [f"{camera.width} x {camera.height}" for camera in cameras]
