"""Measures the time of an encode by stage.

    python benchmarks/encode.py CAPTURE [--preset P] [--set KEY=VALUE] [--frames N] [--json]

Seconds of the canonical scene include all iterations and the loading of kernels. Seconds of a frame
are the mean from the third frame on, when everything that loads or compiles at first use is ready.
"""

import argparse
import io
import json
import os
import platform
from pathlib import Path
from typing import Any

from quarc_ref.cli.encoder_options import make_config
from quarc_ref.datasets.open_capture import open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import PRESETS
from quarc_ref.inspection.inspect_stream import inspect_stream
from steady_timer import FIRST_FRAME, STAGES, SteadyTimer


def measure(folder: Path, config: EncoderConfig, frames: int) -> dict[str, Any]:
    """Return the seconds of an encode and its number of Gaussians."""
    steady, sink = SteadyTimer(), io.BytesIO()
    encode(open_capture(folder), sink, EncodeOptions(config, frames, "cpu", steady))
    counted = frames - FIRST_FRAME
    each = {stage: steady.timer.seconds.get(stage, 0.0) / counted for stage in STAGES}
    return {
        "capture": folder.resolve().name,
        "gaussians": inspect_stream(sink.getvalue()).frames[0].gaussians,
        "iterations": {
            "canonical": config.canonical.iterations,
            "motion": config.motion.iterations,
            "births": config.births.iterations,
        },
        "seconds_canonical": steady.canonical,
        "seconds_per_frame": sum(each.values()),
        "seconds_per_frame_by_stage": each,
        "machine": {
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
        },
    }


def format_table(row: dict[str, Any]) -> str:
    """Return a row as a table in Markdown."""
    stages: dict[str, float] = row["seconds_per_frame_by_stage"]
    seconds = [row["seconds_canonical"], row["seconds_per_frame"], *stages.values()]
    heads = ["capture", "Gaussians", "canonical s", "frame s", *stages]
    cells = [row["capture"], f"{row['gaussians']:,}", *(f"{value:.2f}" for value in seconds)]
    lines = (heads, ["---"] * len(heads), cells)
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Measure one capture."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("capture", type=Path, metavar="CAPTURE")
    parser.add_argument("--preset", choices=sorted(PRESETS), default="main")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="changes")
    parser.add_argument("--frames", type=int, default=6)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", action="store_true")
    arguments = parser.parse_args()
    if arguments.frames <= FIRST_FRAME:
        parser.error(f"--frames takes at least {FIRST_FRAME + 1}")
    config = make_config(arguments.preset, arguments.changes, arguments.seed)
    row = measure(arguments.capture, config, arguments.frames)
    print(json.dumps(row, indent=2) if arguments.json else format_table(row))


if __name__ == "__main__":
    main()
