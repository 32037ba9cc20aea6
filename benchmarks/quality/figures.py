"""Measures the bytes of a stream by kind, and its quality on held-out and training cameras."""

from paper.quality import fit_slope
from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.camera_group import CameraGroup
from quarc_ref.evaluation.camera_meter import Measures
from quarc_ref.evaluation.color_correction import GAIN_CORRECTION
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.format import container
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import StreamSummary
from quarc_ref.streams import decode

Figures = dict[str, float | None]  # by name; None if the figure is undefined

_SIDE_CHUNK_TYPES = {kind.decode() for kind in (container.HEAD, container.CAME, container.META)}
_CANONICAL_TYPE = container.CANO.decode()


def measure_stream(
    data: bytes, capture: Capture, lpips: Lpips | None
) -> tuple[Figures, dict[str, list[Measures]]]:
    """Return the figures of a stream and of each of its frames.

    Args:
        data: Bytes of the stream.
        capture: Capture from which the stream was encoded.
        lpips: LPIPS network; None to skip LPIPS.

    Returns:
        The figures of the stream; and the figures of each frame, under the keys `held_out` and
        `training`, as means over the cameras of the group. Names of figures that are measured on
        cameras start with `held_out_` or `training_`. In names with `cc`, rendered colors were
        corrected by an affine transform; in names with `gain`, by a gain per channel.
    """
    summary = inspect_stream(data)
    held_out = CameraGroup(capture, summary.cameras, capture.held_out, lpips=lpips)
    training = CameraGroup(capture, summary.cameras, capture.training, GAIN_CORRECTION)
    for scene in decode(data):
        splats = dequantize(scene)
        held_out.measure(splats, scene.frame)
        training.measure(splats, scene.frame)
    groups = {"held_out": held_out.quality, "training": training.quality}
    figures = summarize_sizes(summary) | {"held_out_lpips": None}
    for group, quality in groups.items():
        figures |= {f"{group}_{name}": value for name, value in quality.mean().items()}
        figures[f"{group}_slope"] = fit_slope(quality.psnr)
    per_frame = {group: quality.by_frame() for group, quality in groups.items()}
    return figures, per_frame


def summarize_sizes(summary: StreamSummary) -> Figures:
    """Return the number of Gaussians of a stream, and its bytes by kind.

    Args:
        summary: Summary of the stream.

    Returns:
        The figures by name. `bytes_canonical` is the size of all chunks with canonical frames,
        `bytes_side` that of HEAD, cameras and metadata. `bytes_motion`, `bytes_updates` and
        `bytes_births` are the sizes of the coded motion, updates and births. `bytes_other` is the
        size of everything else, such as snapshots, INDX, TAIL and chunk headers of other frames.
    """
    coded_bytes = summary.coded_bytes()
    side_bytes = sum(
        chunk.byte_count for chunk in summary.chunks if chunk.kind in _SIDE_CHUNK_TYPES
    )
    canonical_bytes = sum(
        chunk.byte_count for chunk in summary.chunks if chunk.kind == _CANONICAL_TYPE
    )
    moved_bytes = {f"bytes_{kind}": coded_bytes[kind] for kind in ("motion", "updates", "births")}
    listed_bytes = side_bytes + canonical_bytes + sum(moved_bytes.values())
    other_frames = [frame for frame in summary.frames if not frame.canonical]
    mean_kilobytes = summary.kilobytes_per_frame()["without_canonical"] if other_frames else None
    return {
        "gaussians_first": summary.frames[0].gaussians,
        "gaussians": summary.gaussian_count,
        "bytes": summary.total_bytes,
        "bytes_side": side_bytes,
        "bytes_canonical": canonical_bytes,
        **moved_bytes,
        "bytes_other": summary.total_bytes - listed_bytes,
        "kb_per_frame": mean_kilobytes,
    }
