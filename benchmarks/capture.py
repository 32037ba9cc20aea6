"""Encodes captures, decodes the streams, and measures their quality on held-out cameras.

    python benchmarks/capture.py CAPTURE... [--preset P] [--frames N] [--json]

Prints a row for each capture: the quality of the decoded stream, its size relative to the paper's
estimate, and the encoding time of frame 0 and of each later frame.
"""

import argparse
import io
import json
import os
import platform
import time
from pathlib import Path
from typing import Any

from expected_errors import report_errors
from options import parse_positive
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.presets import PRESETS, choose_preset
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.inspection.stream_summary import KINDS


class StageClock:
    """Records when each stage of the encoder last reported its progress."""

    def __init__(self) -> None:
        self.start = time.monotonic()
        self.last_report: dict[str, float] = {}

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        del done, total
        self.last_report[stage] = time.monotonic() - self.start


def measure(folder: Path, preset: str, frames: int | None) -> dict[str, Any]:
    """Encode a capture, evaluate the stream, and return a row of results."""
    clock, sink = StageClock(), io.BytesIO()
    capture = open_capture(folder)
    options = EncodeOptions(choose_preset(preset), frames, device="cpu", progress=clock)
    encode(capture, sink, options)
    encode_seconds = time.monotonic() - clock.start
    evaluation = evaluate_stream(sink.getvalue(), folder, lambda *_: None)
    summary, psnr = evaluation.summary, evaluation.quality.psnr
    canonical_seconds = clock.last_report["canonical"]
    return {
        "capture": capture.name,
        "preset": preset,
        "frames": len(psnr),
        "gaussians": summary.frames[-1].gaussians,
        "psnr_first": psnr[0],
        "psnr_mean": sum(psnr) / len(psnr),
        "psnr_worst": min(psnr),
        "ssim_mean": sum(evaluation.quality.ssim) / len(psnr),
        "kb_per_frame": summary.kilobytes_per_frame()["without_canonical"],
        "bytes": summary.coded_bytes(),
        "estimate_bytes": summary.estimate_bytes(),
        "seconds_canonical": canonical_seconds,
        "seconds_per_frame": (encode_seconds - canonical_seconds) / max(len(psnr) - 1, 1),
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
            f"{row['ssim_mean']:.4f} | {row['kb_per_frame']:.2f} | "
            f"{coded_bytes['canonical'] / 1024:.0f} | {ratios} | "
            f"{row['seconds_canonical']:.0f} | {row['seconds_per_frame']:.1f} |"
        )  # fmt: skip


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
