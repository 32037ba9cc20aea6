"""Writes an HTML page about the quality of a stream: pictures, curves and sizes.

The page embeds its pictures, which are also written as separate files.
"""

import html
import re
from importlib import resources
from pathlib import Path

import numpy as np

from quarc_ref.evaluation.evaluate import Evaluation
from quarc_ref.evaluation.metrics import PSNR_VARIANT, SSIM_VARIANT, Picture
from quarc_ref.evaluation.pages import embed_png, fill_page, format_lines, format_table
from quarc_ref.evaluation.plots import Curve, encode_picture, plot_bytes_by_kind, plot_frames
from quarc_ref.evaluation.quality import Quality
from quarc_ref.evaluation.views import View
from quarc_ref.files import OutputFolder
from quarc_ref.inspection.stream_summary import KINDS, StreamSummary
from quarc_ref.wording import format_count

DIFFERENCE_GAIN = 4
_MAX_NAME_LENGTH = 100


def write_report(evaluation: Evaluation, folder: OutputFolder) -> Path:
    """Write the page and its pictures; return the page's path.

    Args:
        evaluation: Measurements to show.
        folder: Output folder from `quarc_ref.files.written_folder`.
    """
    pictures = {
        "frames.png": plot_frames(
            evaluation.summary, Curve(evaluation.frames, evaluation.quality.psnr)
        ),
        "bytes.png": plot_bytes_by_kind(evaluation.summary),
    }
    for view in evaluation.shown_views:
        for name, picture in _make_pictures(view).items():
            pictures[_name_file(view, name)] = encode_picture(picture)
    for name, data in pictures.items():
        folder.write(name, data)
    return folder.write("index.html", _compose_page(evaluation, pictures))


def _name_file(view: View, name: str) -> str:
    """Return a safe file name for a camera name, which can be any text, such as a long path.

    All views are of the same camera, so its name may be shortened.
    """
    camera = re.sub(r"[^A-Za-z0-9-]", "_", view.camera)[:_MAX_NAME_LENGTH]
    return f"{camera}_{view.frame:04}_{name}.png"


def _make_pictures(view: View) -> dict[str, Picture]:
    difference = np.abs(view.decoded - view.truth) * np.float32(DIFFERENCE_GAIN)
    return {"truth": view.truth, "decoded": view.decoded, "difference": difference}


def _compose_page(evaluation: Evaluation, pictures: dict[str, bytes]) -> bytes:
    template = resources.files(__package__).joinpath("report.html").read_text("utf-8")
    summary = evaluation.summary
    name = summary.metadata.get("capture", "stream")
    held_out = ", ".join(evaluation.protocol.held_out_cameras)
    parts = {
        "title": html.escape(f"{name}: {format_count(len(summary.frames), 'frame')}"),
        "subtitle": html.escape(
            f"Rendered from the decoded stream and measured on {held_out}, held out from training. "
            f"{PSNR_VARIANT}. {SSIM_VARIANT}. 1 KB is 1024 bytes."
        ),
        "figures": _compose_key_figures(evaluation),
        "cameras_table": _compose_cameras_table(evaluation.quality),
        "views": "".join(_compose_view(view, pictures) for view in evaluation.shown_views),
        "frames_plot": embed_png(pictures["frames.png"]),
        "kinds_plot": embed_png(pictures["bytes.png"]),
        "bytes_table": _compose_bytes_table(summary),
        "protocol": format_lines(evaluation.protocol.as_texts()),
        "settings": format_lines(summary.metadata),
    }
    return fill_page(template, parts)


def _compose_key_figures(evaluation: Evaluation) -> str:
    summary, quality = evaluation.summary, evaluation.quality
    mean = quality.mean()
    rates = summary.kilobytes_per_frame()
    moved_rate = rates["without_canonical"]  # 0 if all frames are keyframes
    key_figures = {
        "PSNR, mean": f"{mean['psnr']:.2f} dB",
        "PSNR, first frame": f"{quality.psnr[0]:.2f} dB",
        "PSNR, worst frame": f"{min(quality.psnr):.2f} dB",
        "SSIM, mean": f"{mean['ssim']:.4f}",
        "KB per frame, without keyframes": f"{moved_rate:.2f}" if moved_rate else "no such frame",
        "KB per frame, whole stream": f"{rates['with_canonical']:.2f}",
        "Gaussians": f"{summary.frames[-1].gaussians:,}",
        "whole stream": f"{summary.total_bytes:,} bytes",
    }
    return "".join(
        f"<div><dt>{key}</dt><dd>{value}</dd></div>" for key, value in key_figures.items()
    )


def _compose_cameras_table(quality: Quality) -> str:
    return format_table(["camera", *quality.headings()], quality.as_rows())


def _compose_view(view: View, pictures: dict[str, bytes]) -> str:
    images = "".join(
        f'<img alt="{name} of frame {view.frame}" '
        f'src="{embed_png(pictures[_name_file(view, name)])}">'
        for name in ("truth", "decoded", "difference")
    )
    caption = (
        f"frame {view.frame}, {html.escape(view.camera)}: {view.psnr:.2f} dB, "
        f"SSIM {view.ssim:.4f}; from left: truth, decoded, difference times {DIFFERENCE_GAIN}"
    )
    return f'<figure><div class="views">{images}</div><figcaption>{caption}</figcaption></figure>'


def _compose_bytes_table(summary: StreamSummary) -> str:
    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    rows = []
    for kind in (*KINDS, "overhead", "total"):
        estimated_bytes = estimate.get(kind)
        estimate_text = "" if estimated_bytes is None else f"{estimated_bytes:,}"
        ratio = f"{coded[kind] / estimated_bytes:.3f}" if estimated_bytes else ""
        rows.append((kind, f"{coded[kind]:,}", estimate_text, ratio))
    return format_table(("kind", "bytes", "zero-order estimate", "bytes / estimate"), rows)
