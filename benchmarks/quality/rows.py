"""Makes a row: encodes a capture with one seed, measures the decoded stream, and saves the row."""

import hashlib
import io
import json
from dataclasses import asdict, dataclass
from pathlib import Path

from atomic_files import write_atomically
from quality.figures import measure_stream
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.stage_timer import StageTimer
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.protocol import make_protocol
from studies import ProgressLines, Row, average_stage_seconds, digest_file, load_row, save_row


@dataclass(frozen=True, slots=True)
class Task:
    """An encode of a capture, with all inputs of its row.

    Attributes:
        capture: Name of the capture.
        held_out_set: Ordinal of the set of held-out cameras.
        source: Folder of the capture.
        options: Options for opening the capture: resolution and held-out cameras.
        config: Settings of the encoder, including the seed.
        frames: Number of frames to encode, from the first frame on.
        folder: Folder for rows and streams.
        lpips: File with LPIPS weights; None to skip LPIPS.
        device: Device to train on.
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
        """Name of the task, which is unique in the study."""
        return f"{self.capture}.set{self.held_out_set}.seed{self.config.seed}"

    @property
    def row_path(self) -> Path:
        """Path of the JSON file with the row."""
        return self.folder / "rows" / f"{self.name}.json"

    @property
    def stream_path(self) -> Path:
        """Path of the stream."""
        return self.folder / "streams" / f"{self.name}.quarc"

    def load_saved_row(self, fingerprint: str) -> Row | None:
        """Return the saved row; None if it is missing, or if it was made from different inputs."""
        return load_row(self.row_path, self._compute_key(fingerprint))

    def save(self, fingerprint: str, row: Row) -> None:
        """Save the row."""
        save_row(self.row_path, self._compute_key(fingerprint), row)

    def _compute_key(self, fingerprint: str) -> str:
        """Return a digest of everything that determines the row, except the code."""
        inputs = {
            "capture": fingerprint,
            "size": asdict(self.options),
            "frames": self.frames,
            "settings": [[name, f"{value}"] for name, value in list_settings(self.config)],
            "lpips": self.lpips is not None and digest_file(self.lpips),
            "device": self.device,
        }
        return hashlib.sha256(json.dumps(inputs).encode()).hexdigest()


def make_row(task: Task) -> None:
    """Encode the capture, measure the decoded stream and save the row; do nothing if it exists."""
    capture = open_capture(task.source, task.options)
    if task.load_saved_row(capture.fingerprint) is not None:
        return
    lpips = Lpips(task.lpips) if task.lpips else None
    timer, sink = StageTimer(ProgressLines(task.name)), io.BytesIO()
    encode(capture, sink, EncodeOptions(task.config, task.frames, task.device, timer))
    write_atomically(task.stream_path, sink.getvalue())
    seconds = average_stage_seconds(timer.seconds, task.frames)
    figures, per_frame = measure_stream(task.stream_path.read_bytes(), capture, lpips)
    figures |= {
        "seconds_first": seconds["canonical"] + seconds["canonical commit"],
        "seconds_frame": seconds["frame"] if task.frames > 1 else None,
    }
    seed, fingerprint = task.config.seed, capture.fingerprint
    protocol = make_protocol(capture, capture.cameras, range(task.frames), seed, fingerprint)
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
    task.save(capture.fingerprint, row)
