"""Measures a stream: size by kind, and quality on held-out and training cameras."""

from collections.abc import Callable, Sequence
from statistics import fmean

from paper.quality import fit_slope
from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.camera_group import CameraGroup
from quarc_ref.evaluation.camera_meter import Measures
from quarc_ref.evaluation.color_correction import GAIN
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.views import View
from quarc_ref.format import container
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import StreamSummary
from quarc_ref.streams import decode

Figures = dict[str, float | None]  # by name; None if there is nothing to measure

_SIDE_CHUNKS = {kind.decode() for kind in (container.HEAD, container.CAME, container.META)}
_CANONICAL = container.CANO.decode()


def measure_stream(
    data: bytes, capture: Capture, lpips: Lpips | None
) -> tuple[Figures, dict[str, list[Measures]]]:
    """Return the figures of a stream and of each of its frames.

    Args:
        data: The stream.
        capture: Capture that it was made from.
        lpips: The metric; None to leave out LPIPS.

    Returns:
        Figures of the whole stream, with the prefixes `held_out_` and `training_` for those of
        cameras; means over the cameras by frame, under `held_out` and `training`. Held-out cameras
        are corrected by an affine color transform (`cc`), training cameras by gains (`gain`).
    """
    summary = inspect_stream(data)
    held_out = CameraGroup(capture, summary.cameras, capture.held_out)
    training = CameraGroup(capture, summary.cameras, capture.training, GAIN)
    distances = []
    for scene in decode(data):
        splats = dequantize(scene)
        views = held_out.measure(splats, scene.frame)
        training.measure(splats, scene.frame)
        if lpips is not None:
            distances.append(_measure_lpips(views, lpips.measure))
    groups = {"held_out": held_out.quality, "training": training.quality}
    figures = measure_size(summary)
    for group, quality in groups.items():
        figures |= {f"{group}_{name}": value for name, value in quality.mean().items()}
        figures[f"{group}_slope"] = fit_slope(quality.psnr)
    figures["held_out_lpips"] = fmean(distances) if distances else None
    per_frame = {group: quality.by_frame() for group, quality in groups.items()}
    return figures, per_frame


def measure_size(summary: StreamSummary) -> Figures:
    """Return Gaussians and bytes by kind of a stream.

    Args:
        summary: Of the stream.

    Returns:
        Chunks of canonical frames are counted completely. For other frames, the coded planes are
        counted by kind; their framing is counted as `bytes_other`, with index and end.
    """
    coded = summary.coded_bytes()
    side = sum(chunk.byte_count for chunk in summary.chunks if chunk.kind in _SIDE_CHUNKS)
    canonical = sum(chunk.byte_count for chunk in summary.chunks if chunk.kind == _CANONICAL)
    named = side + canonical + coded["motion"] + coded["births"]
    has_moved = any(not frame.canonical for frame in summary.frames)
    return {
        "gaussians_first": summary.frames[0].gaussians,
        "gaussians": summary.gaussian_count,
        "bytes": summary.total_bytes,
        "bytes_side": side,
        "bytes_canonical": canonical,
        "bytes_motion": coded["motion"],
        "bytes_births": coded["births"],
        "bytes_other": summary.total_bytes - named,
        "kb_per_frame": summary.kilobytes_per_frame()["without_canonical"] if has_moved else None,
    }


def _measure_lpips(views: Sequence[View], measure: Callable[..., float]) -> float:
    return fmean(measure(view.decoded, view.truth) for view in views)
