"""Encodes captures, decodes the streams, and measures their quality on held-out cameras.

    python benchmarks/capture.py CAPTURE... [--preset P] [--frames N] [--json]

Prints a row for each capture: the quality of the decoded stream, its size relative to the paper's
estimate, and the encoding time of frame 0 and of each later frame. The time of frame 0 includes the
checks of the capture and the coding of the frame.
"""

import argparse
import io
import json
import os
import platform
from pathlib import Path
from typing import Any

from expected_errors import report_errors
from options import parse_positive
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.presets import PRESETS, choose_preset
from quarc_ref.encoder.stage_timer import StageTimer
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.inspection.stream_summary import KINDS
from studies import average_stage_seconds


def measure(folder: Path, preset: str, frames: int | None) -> dict[str, Any]:
    """Encode a capture, evaluate the stream, and return a row of results."""
    capture, sink = open_capture(folder), io.BytesIO()
    timer = StageTimer()
    encode(capture, sink, EncodeOptions(choose_preset(preset), frames, "cpu", timer))
    evaluation = evaluate_stream(sink.getvalue(), folder, lambda *_: None)
    summary, psnr = evaluation.summary, evaluation.quality.psnr
    seconds = average_stage_seconds(timer.seconds, len(psnr))
    has_later_frames = len(psnr) > 1
    return {
        "capture": capture.name,
        "preset": preset,
        "frames": len(psnr),
        "gaussians": summary.frames[-1].gaussians,
        "psnr_first": psnr[0],
        "psnr_mean": sum(psnr) / len(psnr),
        "psnr_worst": min(psnr),
        "ssim_mean": sum(evaluation.quality.ssim) / len(psnr),
        "kb_per_frame": summary.kilobytes_per_frame()["without_canonical"]
        if has_later_frames
        else None,
        "bytes": summary.coded_bytes(),
        "estimate_bytes": summary.estimate_bytes(),
        "seconds_canonical": seconds["canonical"] + seconds["canonical commit"],
        "seconds_per_frame": seconds["frame"] if has_later_frames else None,
    }


def print_markdown(rows: list[dict[str, Any]]) -> None:
    """Print the rows as a Markdown table."""
    print(
        "| capture | preset | frames | Gaussians | PSNR in dB: first / mean / worst frame | SSIM | "
        "KB per later frame | canonical frame in KB | size relative to the paper's estimate: "
        f"{', '.join(KINDS)} | seconds for frame 0 | seconds per later frame |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for row in rows:
        coded_bytes, estimate_bytes = row["bytes"], row["estimate_bytes"]
        ratios = ", ".join(
            f"{coded_bytes[kind] / estimate_bytes[kind]:.2f}" if estimate_bytes[kind] else "none"
            for kind in KINDS
        )
        print(
            f"| {row['capture']} | {row['preset']} | {row['frames']} | {row['gaussians']:,} | "
            f"{row['psnr_first']:.2f} / {row['psnr_mean']:.2f} / {row['psnr_worst']:.2f} | "
            f"{row['ssim_mean']:.4f} | {_format(row['kb_per_frame'], '.2f')} | "
            f"{coded_bytes['canonical'] / 1024:.0f} | {ratios} | "
            f"{row['seconds_canonical']:.0f} | {_format(row['seconds_per_frame'], '.1f')} |"
        )  # fmt: skip


def _format(figure: float | None, format_spec: str) -> str:
    return "none" if figure is None else f"{figure:{format_spec}}"


def main() -> None:
    """Measure all captures given on the command line, and print their rows."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("captures", nargs="+", type=Path, metavar="CAPTURE")
    parser.add_argument("--preset", choices=sorted(PRESETS), default="main")
    parser.add_argument("--frames", type=parse_positive)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    rows = [measure(folder, arguments.preset, arguments.frames) for folder in arguments.captures]
    if arguments.json:
        machine = {"processor": platform.processor() or platform.machine(), "cores": os.cpu_count()}
        print(json.dumps({"machine": machine, "rows": rows}, indent=2))
    else:
        print_markdown(rows)


if __name__ == "__main__":
    with report_errors():
        main()
