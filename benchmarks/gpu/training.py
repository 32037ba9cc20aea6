"""Encodes the traced capture and measures its time and memory."""

import io
from dataclasses import dataclass
from pathlib import Path

import torch

from gpu.plan import Sizes
from gpu.rows import Notebook, Row
from gpu.scene import load_capture
from quarc_ref.encoder import EncodeOptions, change_setting, choose_preset, encode
from quarc_ref.encoder.settings.config import EncoderConfig
from steady_timer import SteadyTimer

_NOTES_EVERY = 100


@dataclass(frozen=True, slots=True)
class Training:
    """A finished encode.

    Attributes:
        stream: Its bytes.
        timer: Seconds of frame 0, and of every stage of the frames from the third on.
    """

    stream: bytes
    timer: SteadyTimer


def make_config(changes: dict[str, object]) -> EncoderConfig:
    """Return the preset `main` with settings changed."""
    config = choose_preset("main")
    for name, value in changes.items():
        config = change_setting(config, name, str(value))
    return config


def train(
    sizes: Sizes, folder: Path, notebook: Notebook, config: EncoderConfig, frames: int
) -> Training:
    """Encode frames of the traced capture and report the progress."""
    watch = _Watch(notebook)
    options = EncodeOptions(config, frames, sizes.device, watch, checks=False)
    sink = io.BytesIO()
    if sizes.device == "cuda":
        torch.cuda.reset_peak_memory_stats()
    encode(load_capture(sizes, folder), sink, options)
    return Training(sink.getvalue(), watch.timer)


def describe_memory(step: str, sizes: Sizes) -> Row:
    """Return the row of the peak GPU memory allocated since the start of training."""
    if sizes.device != "cuda":
        return Row(step, "peak GPU memory", "none: no GPU")
    peak = torch.cuda.max_memory_allocated() / 2**30
    return Row(step, "peak GPU memory", f"{peak:.2f} GiB", figures={"gib": peak})


class _Watch:
    """Times the stages; reports every hundredth step, which also waits for the GPU."""

    def __init__(self, notebook: Notebook) -> None:
        self.timer = SteadyTimer()
        self._notebook = notebook

    def advance(self, stage: str, done: int, total: int) -> None:
        """See `Progress.advance`."""
        if done % _NOTES_EVERY == 0 or done == total:
            if torch.cuda.is_available():
                torch.cuda.synchronize()
            self._notebook.note(f"{stage} {done} of {total}")
        self.timer.advance(stage, done, total)
