"""Makes the row of a trial: encodes, decodes and measures it, and saves the row as a file.

A saved row is reused if the capture, the options and all settings are unchanged.
"""

import hashlib
import io
import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import fmean

from atomic_files import write_atomically
from canonical_cache import CanonicalCache
from paper.float_bytes import summarize_floats
from paper.quality import MOVING_VARIANT, Quality, fit_slope, measure_quality
from paper.trials import Trial
from paper.unquantized import encode_unquantized
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.decoder import Splats, dequantize
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.presets import list_settings
from quarc_ref.encoder.stage_timer import StageTimer
from quarc_ref.encoder.training.context import Observers, make_context
from quarc_ref.encoder.training.torch_settings import fixed_torch_settings
from quarc_ref.evaluation.lpips import Lpips
from quarc_ref.evaluation.metrics import PSNR_VARIANT, SSIM_VARIANT
from quarc_ref.evaluation.protocol import make_protocol
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import KILOBYTE, KINDS, FrameSummary
from quarc_ref.rendering.backends import choose_device, choose_rasterizer
from quarc_ref.streams import decode
from studies import ProgressLines, Row, average_stage_seconds, digest_file, load_row, save_row


@dataclass(frozen=True, slots=True)
class Task:
    """A trial to run on a capture, with everything that determines its row.

    Attributes:
        trial: Trial to run.
        capture: Folder of the capture.
        options: Options for reading the capture: resolution and held-out cameras.
        frames: Number of frames to encode, starting with the first.
        folder: Folder for rows and streams.
        lpips: File with LPIPS weights; None to skip LPIPS.
        device: Device for training.
    """

    trial: Trial
    capture: Path
    options: CaptureOptions
    frames: int
    folder: Path
    lpips: Path | None = None
    device: str = "cpu"

    @property
    def row_path(self) -> Path:
        """Path of the JSON file with the row."""
        return self.folder / "rows" / f"{self.trial.name}.json"

    @property
    def stream_path(self) -> Path:
        """Path of the stream; trials in floats do not write a stream."""
        return self.folder / "streams" / f"{self.trial.name}.quarc"

    def make_canonical_cache(self, fingerprint: str) -> CanonicalCache:
        """Return the cache that trains or loads frame 0."""
        trial = self.trial
        rounds_canonical = trial.floats != "all"
        inputs = [
            fingerprint,
            asdict(self.options),
            trial.config.seed,
            self.device,
            rounds_canonical,
        ]
        return CanonicalCache(self.folder / "canonical", inputs)

    def compute_key(self, fingerprint: str) -> str:
        """Return a digest of all inputs of the row, except the code."""
        inputs = {
            "capture": fingerprint,
            "size": asdict(self.options),
            "frames": self.frames,
            "settings": [[name, f"{value}"] for name, value in list_settings(self.trial.config)],
            "floats": self.trial.floats,
            "rebinds": self.trial.rebinds,
            "lpips": self.lpips is not None and digest_file(self.lpips),
            "device": self.device,
        }
        return hashlib.sha256(json.dumps(inputs).encode()).hexdigest()

    def load_saved_row(self, fingerprint: str) -> Row | None:
        """Return the saved row; None if it is missing, or if it was made from different inputs."""
        return load_row(self.row_path, self.compute_key(fingerprint))


def make_row(task: Task) -> None:
    """Run a trial, and save its row; do nothing if the row already exists."""
    capture = open_capture(task.capture, task.options)
    if task.load_saved_row(capture.fingerprint) is not None:
        return
    lpips = Lpips(task.lpips) if task.lpips else None
    timer = StageTimer(ProgressLines(task.trial.name))
    measure = _measure_floats if task.trial.floats else _measure_stream
    row = measure(task, capture, lpips, timer)
    save_row(task.row_path, task.compute_key(capture.fingerprint), {"name": task.trial.name, **row})


def _measure_stream(task: Task, capture: Capture, lpips: Lpips | None, timer: StageTimer) -> Row:
    sink = io.BytesIO()
    canonical_cache = task.make_canonical_cache(capture.fingerprint)
    with canonical_cache.use_in_encode():
        encode(capture, sink, EncodeOptions(task.trial.config, task.frames, task.device, timer))
    data = sink.getvalue()
    write_atomically(task.stream_path, data)
    summary = inspect_stream(data)
    scenes = ((scene.frame, dequantize(scene)) for scene in decode(data))
    quality = measure_quality(scenes, summary.cameras, capture, lpips)
    seconds = timer.seconds | {"canonical": canonical_cache.seconds}
    return _compose_row(task, capture, lpips, summary.frames, len(data), quality, seconds)


def _measure_floats(task: Task, capture: Capture, lpips: Lpips | None, timer: StageTimer) -> Row:
    frames: list[FrameSummary] = []
    canonical_cache = task.make_canonical_cache(capture.fingerprint)
    context = make_context(capture, task.device, task.trial.config.seed, Observers(timer))

    def encode_frames() -> Iterator[tuple[int, Splats]]:
        float_frames = encode_unquantized(
            capture, task.trial, task.frames, context, canonical_cache.train
        )
        for float_frame in float_frames:
            frames.append(summarize_floats(float_frame, task.trial))
            yield float_frame.state.scene.frame, dequantize(float_frame.state.scene)
            timer.skip()

    with fixed_torch_settings():
        quality = measure_quality(encode_frames(), capture.cameras, capture, lpips)
    total_bytes = sum(frame.chunk_bytes for frame in frames)
    seconds = timer.seconds | {"canonical": canonical_cache.seconds}
    return _compose_row(task, capture, lpips, tuple(frames), total_bytes, quality, seconds)


def _compose_row(
    task: Task,
    capture: Capture,
    lpips: Lpips | None,
    frames: tuple[FrameSummary, ...],
    total_bytes: int,
    quality: Quality,
    seconds: dict[str, float],
) -> Row:
    """Return the row of a trial from its measurements."""
    seed = task.trial.config.seed
    ordinals = [frame.frame for frame in frames]
    protocol = make_protocol(
        capture, capture.cameras, ordinals, seed, capture.fingerprint
    ).as_json()
    metrics = {"psnr": PSNR_VARIANT, "ssim": SSIM_VARIANT, "psnr_moving": MOVING_VARIANT}
    if lpips is not None:
        metrics["lpips"] = lpips.variant
    training_renderer = choose_rasterizer(choose_device(task.device)).name
    return {
        "floats": task.trial.floats,
        "rebinds": task.trial.rebinds,
        "frames": len(frames),
        "quality": _summarize_quality(quality),
        "bytes": _summarize_sizes(frames, total_bytes),
        "births": [frame.births for frame in frames],
        "deaths": [frame.deaths for frame in frames],
        "gaussians": [frame.gaussians for frame in frames],
        "anchors": max(frame.anchors for frame in frames),
        "canonical_sha256": frames[0].sha256,
        "seconds": average_stage_seconds(seconds, len(frames)),
        "seed": seed,
        "renderer": {"training": training_renderer, "measuring": protocol["renderer"]},
        "protocol": {**protocol, "metrics": metrics},
        "per_frame": asdict(quality),
    }


def _summarize_quality(quality: Quality) -> Row:
    moving_psnr = [psnr for psnr in quality.psnr_moving if psnr is not None]
    return {
        "psnr": fmean(quality.psnr),
        "psnr_first": quality.psnr[0],
        "psnr_worst": min(quality.psnr),
        "psnr_slope": fit_slope(quality.psnr),
        "psnr_moving": fmean(moving_psnr) if moving_psnr else None,
        "ssim": fmean(quality.ssim),
        "lpips": fmean(quality.lpips) if quality.lpips else None,
    }


def _summarize_sizes(frames: tuple[FrameSummary, ...], total_bytes: int) -> Row:
    """Return sizes in KB of the canonical frame, and per later frame by kind; and total bytes."""
    later_frames = [frame for frame in frames if not frame.canonical]
    frame_count = max(len(later_frames), 1)
    bytes_by_kind = {kind: sum(frame.coded_bytes[kind] for frame in frames) for kind in KINDS}
    estimates_by_kind = {
        kind: sum(frame.estimate_bytes[kind] for frame in frames) for kind in KINDS
    }
    later_bytes = sum(frame.chunk_bytes for frame in later_frames)
    return {
        "total": total_bytes,
        "canonical_kb": bytes_by_kind["canonical"] / KILOBYTE,
        "motion_kb_per_frame": bytes_by_kind["motion"] / frame_count / KILOBYTE,
        "updates_kb_per_frame": bytes_by_kind["updates"] / frame_count / KILOBYTE,
        "births_kb_per_frame": bytes_by_kind["births"] / frame_count / KILOBYTE,
        "overhead_kb": (total_bytes - sum(bytes_by_kind.values())) / KILOBYTE,
        "kb_per_frame": later_bytes / frame_count / KILOBYTE,
        "canonical_estimate_kb": estimates_by_kind["canonical"] / KILOBYTE,
        "motion_estimate_kb_per_frame": estimates_by_kind["motion"] / frame_count / KILOBYTE,
        "updates_estimate_kb_per_frame": estimates_by_kind["updates"] / frame_count / KILOBYTE,
        "births_estimate_kb_per_frame": estimates_by_kind["births"] / frame_count / KILOBYTE,
    }
