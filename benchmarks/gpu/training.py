"""Encodes the ray-traced capture, and measures the time and GPU memory of the encode."""

import io
from dataclasses import dataclass
from pathlib import Path

import torch

from gpu.plan import Sizes
from gpu.rows import Row, RowLog
from gpu.scene import load_capture
from quarc_ref.encoder import EncodeOptions, change_setting, choose_preset, encode
from quarc_ref.encoder.settings.config import EncoderConfig
from steady_timer import SteadyTimer

_REPORT_INTERVAL = 100


@dataclass(frozen=True, slots=True)
class TrainingResult:
    """A finished encode.

    Attributes:
        stream: Bytes of the stream.
        timer: Times in seconds: of frame 0, and of each stage in the frames from the third on.
    """

    stream: bytes
    timer: SteadyTimer


def make_config(changes: dict[str, object]) -> EncoderConfig:
    """Return the settings of preset `main` with these changes."""
    config = choose_preset("main")
    for name, value in changes.items():
        config = change_setting(config, name, str(value))
    return config


def train(
    sizes: Sizes, folder: Path, row_log: RowLog, config: EncoderConfig, frames: int
) -> TrainingResult:
    """Encode frames of the ray-traced capture, and write the progress to a log."""
    reporter = _StageReporter(row_log)
    options = EncodeOptions(config, frames, sizes.device, reporter, checks=False)
    sink = io.BytesIO()
    if sizes.device == "cuda":
        torch.cuda.reset_peak_memory_stats()
    encode(load_capture(sizes, folder), sink, options)
    return TrainingResult(sink.getvalue(), reporter.timer)


def describe_memory(step: str, sizes: Sizes) -> Row:
    """Return a row with the peak GPU memory since the start of training."""
    if sizes.device != "cuda":
        return Row(step, "peak GPU memory", "not measured: there is no GPU")
    peak = torch.cuda.max_memory_allocated() / 2**30
    return Row(step, "peak GPU memory", f"{peak:.2f} GiB", figures={"gib": peak})


class _StageReporter:
    """Times the stages; every 100 iterations, it waits for the GPU and writes the progress."""

    def __init__(self, row_log: RowLog) -> None:
        self.timer = SteadyTimer()
        self._row_log = row_log

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        if done % _REPORT_INTERVAL == 0 or done == total:
            if torch.cuda.is_available():
                torch.cuda.synchronize()
            self._row_log.write_progress(f"{stage} {done} of {total}")
        self.timer.advance(stage, done, total)
