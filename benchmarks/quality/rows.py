"""A row: one capture encoded with one seed, decoded from the file, measured and saved."""

import hashlib
import io
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from kept_files import write_atomically
from quality.figures import measure_stream
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.stage_timer import StageTimer
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.protocol import describe_protocol
from studies import ProgressLines, Row, load_row, save_row, sum_seconds


@dataclass(frozen=True, slots=True)
class Task:
    """One encode, with everything that a process needs for its row.

    Attributes:
        capture: Name of the capture.
        held_out_set: Ordinal of the set of held-out cameras.
        source: Folder of the capture.
        options: Resolution and held-out cameras.
        config: Settings of the encoder, including the seed.
        frames: Number of frames, from the first.
        folder: Folder of rows and streams.
        lpips: File of the weights; None to leave out LPIPS.
        device: Where training runs.
    """

    capture: str
    held_out_set: int
    source: Path
    options: CaptureOptions
    config: EncoderConfig
    frames: int
    folder: Path
    lpips: Path | None = None
    device: str = "cpu"

    @property
    def name(self) -> str:
        """Name that distinguishes it from other tasks of the study."""
        return f"{self.capture}.set{self.held_out_set}.seed{self.config.seed}"

    @property
    def row_path(self) -> Path:
        """Path of the row."""
        return self.folder / "rows" / f"{self.name}.json"

    @property
    def stream_path(self) -> Path:
        """Path of the stream."""
        return self.folder / "streams" / f"{self.name}.quarc"

    def recall(self, fingerprint: str) -> Row | None:
        """Return the saved row; None if there is none, or one of other inputs."""
        return load_row(self.row_path, self._key(fingerprint))

    def keep(self, fingerprint: str, row: Row) -> None:
        """Write the row."""
        save_row(self.row_path, self._key(fingerprint), row)

    def _key(self, fingerprint: str) -> str:
        """Return a digest of everything that the row depends on, except the code."""
        said = {
            "capture": fingerprint,
            "size": asdict(self.options),
            "frames": self.frames,
            "settings": [[name, f"{value}"] for name, value in list_settings(self.config)],
            "lpips": self.lpips is not None,
            "device": self.device,
        }
        return hashlib.sha256(json.dumps(said).encode()).hexdigest()


def make_row(task: Task) -> None:
    """Encode, decode from the file, measure, and save the row, unless it exists."""
    capture = open_capture(task.source, task.options)
    if task.recall(capture.fingerprint) is not None:
        return
    lpips = Lpips(task.lpips) if task.lpips else None
    timer, sink = StageTimer(ProgressLines(task.name)), io.BytesIO()
    encode(capture, sink, EncodeOptions(task.config, task.frames, task.device, timer))
    write_atomically(task.stream_path, sink.getvalue())
    seconds = sum_seconds(timer.seconds, task.frames)
    figures, per_frame = measure_stream(task.stream_path.read_bytes(), capture, lpips)
    figures |= {
        "seconds_first": seconds["canonical"] + seconds["canonical commit"],
        "seconds_frame": seconds["frame"] if task.frames > 1 else None,
    }
    seed, fingerprint = task.config.seed, capture.fingerprint
    protocol = describe_protocol(capture, capture.cameras, task.frames, seed, fingerprint)
    row = {
        "name": task.name,
        "capture": task.capture,
        "held_out_set": task.held_out_set,
        "held_out": list(task.options.held_out),
        "seed": task.config.seed,
        "frames": task.frames,
        "figures": figures,
        "per_frame": per_frame,
        "lpips": lpips.variant if lpips else None,
        "protocol": protocol.as_json(),
    }
    task.keep(capture.fingerprint, row)
