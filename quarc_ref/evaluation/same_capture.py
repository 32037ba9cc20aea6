"""Opens the capture from which a stream was encoded, at the picture size of the stream."""

import re
from collections.abc import Sequence
from pathlib import Path

from quarc_ref.datasets.calibration import CalibratedCamera, DownscaleError
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.findings import format_names
from quarc_ref.datasets.layouts.table import choose_layout
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.format.cameras import Camera
from quarc_ref.inspection.stream_summary import StreamSummary

_SHOWN_DIGITS = 12  # enough digits to distinguish fingerprints


class MismatchError(ValueError):
    """A stream and a capture do not match."""


class OtherCaptureError(MismatchError):
    """A stream matches the cameras of a capture, but was encoded from another capture.

    Attributes:
        fingerprint: Fingerprint of the capture.
        encoded_from: Fingerprint that the stream contains.
    """

    def __init__(self, fingerprint: str, encoded_from: str) -> None:
        self.fingerprint, self.encoded_from = fingerprint, encoded_from
        shown_source, shown_capture = encoded_from[:_SHOWN_DIGITS], fingerprint[:_SHOWN_DIGITS]
        super().__init__(
            f"the stream was made from another capture, with fingerprint {shown_source}...; "
            f"the fingerprint of this capture is {shown_capture}..."
        )


def open_same_capture(
    summary: StreamSummary,
    folder: Path,
    *,
    stop: int | None = None,
    accept_other_capture: bool = False,
) -> Capture:
    """Open the capture of a stream, with the stream's picture size and held-out cameras.

    If the stream has no held-out cameras, those that `open_capture` chooses are held out.

    Args:
        summary: Summary of the stream.
        folder: Folder of the capture.
        stop: Frame before which measuring ends; None to measure all frames.
        accept_other_capture: Whether to accept another capture with the same cameras and picture
            sizes.

    Raises:
        OtherCaptureError: The stream was encoded from another capture.
        MismatchError: The stream cannot be measured on the capture.
        CaptureError: The capture cannot be read.
    """
    held_out_names = tuple(camera.name for camera in summary.cameras if camera.held_out)
    _require_cameras_and_frames(summary)
    start_frame = read_start_frame(summary)
    # Only the files are read to find the factor; opening the capture may compute initial points.
    full_size_cameras = choose_layout(folder).read(folder).cameras
    _require_same_names(_list_names(full_size_cameras), _list_names(summary.cameras))
    downscale = max(1, round(full_size_cameras[0].lens.width / summary.cameras[0].width))
    try:
        options = CaptureOptions(downscale, held_out_names, start=start_frame)
        capture = open_capture(folder, options)
    except DownscaleError as error:
        raise MismatchError(str(error)) from error
    _require_same_sizes(capture.cameras, summary.cameras)
    end = summary.frames[-1].frame + 1
    if capture.frame_count < (end if stop is None else min(end, stop)):
        message = (
            f"frame {end - 1} of the stream is not in the capture, whose last frame is "
            f"{capture.frame_count - 1}: choose frames that the capture has, such as --frames "
            f"0:{capture.frame_count}"
        )
        raise MismatchError(message)
    encoded_from = summary.metadata.get("fingerprint", capture.fingerprint)
    if encoded_from != capture.fingerprint and not accept_other_capture:
        raise OtherCaptureError(capture.fingerprint, encoded_from)
    return capture


def describe_doubt(encoded_from: str | None, fingerprint: str) -> str | None:
    """Return why a stream may not show the frames of a capture; None if it was encoded from it.

    Args:
        encoded_from: Fingerprint in the metadata of the stream; None if there is none.
        fingerprint: Fingerprint of the capture.
    """
    if encoded_from is None:
        return (
            "the stream has no fingerprint of its capture, so it may have been made from another "
            "capture, or joined from frames that are not consecutive"
        )
    if encoded_from != fingerprint:
        return f"the stream was made from another capture, with fingerprint {encoded_from}"
    return None


def read_start_frame(summary: StreamSummary) -> int:
    """Return the frame number in the capture that corresponds to frame 0 of the stream.

    Raises:
        MismatchError: `start` in the stream's metadata is not a frame number.
    """
    start_text = summary.metadata.get("start", "0")
    if not re.fullmatch(r"[0-9]{1,9}", start_text):
        message = f"the metadata 'start' of the stream is {start_text!r}, not a frame number"
        raise MismatchError(message)
    return int(start_text)


def _require_cameras_and_frames(summary: StreamSummary) -> None:
    for name, items in (("cameras", summary.cameras), ("frames", summary.frames)):
        if not items:
            # Streams of `encode` have cameras; other Gaussians are often imported without them.
            hint = ": import takes cameras from sequence.json" if name == "cameras" else ""
            message = f"the stream has no {name}, so it cannot be measured on a capture{hint}"
            raise MismatchError(message)


def _require_same_names(capture_names: list[str], stream_names: list[str]) -> None:
    if capture_names == stream_names:
        return
    places = {
        "capture": [name for name in capture_names if name not in stream_names],
        "stream": [name for name in stream_names if name not in capture_names],
    }
    differences = [
        f"only the {place} has {format_names(names)}" for place, names in places.items() if names
    ]
    message = (
        "the cameras of the capture and those of the stream differ: "
        f"{'; '.join(differences) or 'they have different orders'}"
    )
    raise MismatchError(message)


def _require_same_sizes(
    capture_cameras: Sequence[Camera], stream_cameras: Sequence[Camera]
) -> None:
    for camera, stream_camera in zip(capture_cameras, stream_cameras, strict=True):
        size, stream_size = _format_size(camera), _format_size(stream_camera)
        if size != stream_size:
            message = (
                f"pictures of {camera.name} have {size} pixels in the capture, but {stream_size} "
                "in the stream"
            )
            raise MismatchError(message)


def _list_names(cameras: Sequence[Camera] | Sequence[CalibratedCamera]) -> list[str]:
    return [camera.name for camera in cameras]


def _format_size(camera: Camera) -> str:
    return f"{camera.width} x {camera.height}"
