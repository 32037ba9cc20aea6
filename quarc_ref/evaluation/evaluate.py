"""Quality of a stream on the held-out cameras, from the decoded file and nothing else."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

import numpy as np

from quarc_ref.datasets.calibration import DownscaleError
from quarc_ref.datasets.capture import Capture, Image
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.decoder import Splats, decode, dequantize
from quarc_ref.evaluation.inspect_stream import inspect_stream
from quarc_ref.evaluation.metrics import (
    PSNR_VARIANT,
    SSIM_VARIANT,
    Picture,
    measure_psnr,
    measure_ssim,
)
from quarc_ref.evaluation.protocol import Protocol, describe_protocol
from quarc_ref.evaluation.stream_summary import StreamSummary
from quarc_ref.format.records import Camera
from quarc_ref.rendering.pictures import render_picture

_FEW = 12  # digits that tell fingerprints apart


class MismatchError(ValueError):
    """A stream and a capture that do not belong together."""


class OtherCaptureError(MismatchError):
    """A stream that could be measured on a capture, but was made from another one.

    Attributes:
        fingerprint: Of the capture.
        encoded_from: Fingerprint that the stream names.
    """

    def __init__(self, fingerprint: str, encoded_from: str) -> None:
        self.fingerprint, self.encoded_from = fingerprint, encoded_from
        theirs, ours = encoded_from[:_FEW], fingerprint[:_FEW]
        super().__init__(
            f"the stream was made from another capture, of fingerprint {theirs}...; "
            f"that of this one is {ours}..."
        )


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """What one held-out camera sees of a frame.

    Attributes:
        frame: Ordinal of the frame.
        camera: Name.
        truth: `[H, W, 3]` from 0 to 1.
        decoded: `[H, W, 3]` from 0 to 1, drawn from the decoded scene.
        psnr: dB.
        ssim: As `ssim_inria`.
    """

    frame: int
    camera: str
    truth: Picture
    decoded: Picture
    psnr: float
    ssim: float


@dataclass(frozen=True, slots=True)
class Quality:
    """Metrics of a stream: a number to each frame, the mean over held-out cameras."""

    psnr: tuple[float, ...]
    ssim: tuple[float, ...]

    def as_json(self) -> dict[str, object]:
        """Return what `eval --json` prints of the quality; JSON has no infinity, but null."""
        return {
            "psnr": _finite(float(np.mean(self.psnr))),
            "ssim": float(np.mean(self.ssim)),
            "psnr_per_frame": [_finite(psnr) for psnr in self.psnr],
            "ssim_per_frame": list(self.ssim),
            "metrics": {"psnr": PSNR_VARIANT, "ssim": SSIM_VARIANT},
        }


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


def open_same_capture(
    summary: StreamSummary, folder: Path, *, other_capture: bool = False
) -> Capture:
    """Open the capture of a stream at the stream's size, with its cameras held out.

    Args:
        summary: Of the stream.
        folder: Of the capture.
        other_capture: Whether it may be another one of the same cameras and sizes.

    Raises:
        OtherCaptureError: It is another one.
        MismatchError: The stream cannot be measured on the capture.
        CaptureError: The capture cannot be read.
    """
    held_out = tuple(camera.name for camera in summary.cameras if camera.held_out)
    if not held_out or not summary.frames:
        missing = "frame" if held_out else "camera to keep out of training"
        message = f"the stream has no {missing}: there is nothing to measure"
        raise MismatchError(message)
    full = open_capture(folder)
    _require_equal("cameras", _names(full.cameras), _names(summary.cameras))
    downscale = max(1, round(full.cameras[0].width / summary.cameras[0].width))
    try:
        capture = open_capture(folder, CaptureOptions(downscale=downscale, held_out=held_out))
    except DownscaleError as error:
        raise MismatchError(str(error)) from error
    _require_equal("sizes of pictures", _sizes(capture.cameras), _sizes(summary.cameras))
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
    shown, psnr, ssim = [], [], []
    for index, scene in enumerate(decode(data)):
        views = measure_views(dequantize(scene), scene.frame, summary.cameras, capture)
        psnr.append(float(np.mean([view.psnr for view in views])))
        ssim.append(float(np.mean([view.ssim for view in views])))
        if index in {0, count // 2, count - 1}:
            shown.append(views[0])
        note("evaluate", index + 1, count)
    made_from = summary.metadata.get("fingerprint")
    protocol = describe_protocol(capture, summary.cameras, count, summary.header.seed, made_from)
    return Evaluation(summary, Quality(tuple(psnr), tuple(ssim)), tuple(shown), protocol)


def measure_views(
    splats: Splats, frame: int, cameras: Sequence[Camera], capture: Capture
) -> list[View]:
    """Return what the held-out cameras see of a frame, and how near it is to the truth.

    Args:
        splats: The frame's scene in floats.
        frame: Its ordinal.
        cameras: To draw with, in the order of the capture: those of a stream
            are not to the last bit those of its capture.
        capture: Whose held-out pictures are the truth.
    """
    return [
        _view(splats, cameras[index], capture.image(index, frame), frame)
        for index in capture.held_out
    ]


def _require_equal(subject: str, of_capture: Sequence[str], of_stream: Sequence[str]) -> None:
    for ours, theirs in zip_longest(of_capture, of_stream, fillvalue="none"):
        if ours != theirs:
            message = f"other {subject} in the capture than in the stream: {ours} against {theirs}"
            raise MismatchError(message)


def _names(cameras: Sequence[Camera]) -> list[str]:
    return [camera.name for camera in cameras]


def _sizes(cameras: Sequence[Camera]) -> list[str]:
    return [f"{camera.width} x {camera.height}" for camera in cameras]


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None


def _view(splats: Splats, camera: Camera, image: Image, frame: int) -> View:
    decoded = np.clip(render_picture(splats, camera), 0, 1)
    truth = image.astype(np.float32) / np.float32(255)
    psnr, ssim = measure_psnr(decoded, truth), measure_ssim(decoded, truth)
    return View(frame, camera.name, truth, decoded, psnr, ssim)
