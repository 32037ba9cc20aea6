"""Measures how long each stage of an encode takes.

    python benchmarks/encode.py CAPTURE [--preset P] [--set KEY=VALUE] [--frames N] [--json]

The time of frame 0 includes all iterations and the loading of kernels. The time per frame is the
mean over all frames from the third on, so it does not include the loading and compiling of kernels.
"""

import argparse
import io
import json
import os
import platform
from pathlib import Path
from typing import Any

from expected_errors import report_errors
from options import add_set_option, parse_count, parse_positive
from quarc_ref.cli.encoder_options import make_config
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import PRESETS
from quarc_ref.inspection.inspect_stream import inspect_stream
from steady_timer import FIRST_TIMED_FRAME, STAGES, SteadyTimer


def measure(folder: Path, config: EncoderConfig, frames: int) -> dict[str, Any]:
    """Encode a capture, and return a row with the time of each stage in seconds."""
    timer, sink = SteadyTimer(), io.BytesIO()
    encode(open_capture(folder), sink, EncodeOptions(config, frames, "cpu", timer))
    timed_frame_count = frames - FIRST_TIMED_FRAME
    seconds_by_stage = {
        stage: timer.stage_timer.seconds.get(stage, 0.0) / timed_frame_count for stage in STAGES
    }
    return {
        "capture": folder.resolve().name,
        "gaussians": inspect_stream(sink.getvalue()).frames[0].gaussians,
        "iterations": {
            "canonical": config.canonical.iterations,
            "motion": config.motion.iterations,
            "births": config.births.iterations,
        },
        "seconds_canonical": timer.canonical_seconds,
        "seconds_per_frame": sum(seconds_by_stage.values()),
        "seconds_per_frame_by_stage": seconds_by_stage,
        "machine": {
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
        },
    }


def format_table(row: dict[str, Any]) -> str:
    """Return a row as a Markdown table."""
    seconds_by_stage: dict[str, float] = row["seconds_per_frame_by_stage"]
    seconds = [row["seconds_canonical"], row["seconds_per_frame"], *seconds_by_stage.values()]
    headers = [
        "capture",
        "Gaussians",
        "seconds for frame 0",
        "seconds per frame",
        *seconds_by_stage,
    ]
    cells = [row["capture"], f"{row['gaussians']:,}", *(f"{value:.2f}" for value in seconds)]
    lines = (headers, ["---"] * len(headers), cells)
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Measure one capture, and print its row."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("capture", type=Path, metavar="CAPTURE")
    parser.add_argument("--preset", choices=sorted(PRESETS), default="main")
    add_set_option(parser)
    parser.add_argument("--frames", type=parse_positive, default=6)
    parser.add_argument("--seed", type=parse_count, default=0)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if arguments.frames <= FIRST_TIMED_FRAME:
        parser.error(f"--frames must be at least {FIRST_TIMED_FRAME + 1}")
    config = make_config(arguments.preset, arguments.set, arguments.seed)
    row = measure(arguments.capture, config, arguments.frames)
    print(json.dumps(row, indent=2) if arguments.json else format_table(row))


if __name__ == "__main__":
    with report_errors():
        main()
