"""How fast a stream plays: frames per second, time by stage, memory, startup time."""

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass

from quarc_ref.decoder.engines import choose_engine
from quarc_ref.inspection.peak_memory import measure_peak_mebibytes
from quarc_ref.inspection.stolen_time import read_processor_time
from quarc_ref.playback import Player
from quarc_ref.streams import open_source


@dataclass(frozen=True, slots=True)
class Speed:
    """How fast a stream was decoded, each frame returned as soon as it was ready.

    Attributes:
        frames: Number of frames, including the first, which is canonical.
        gaussians: Number of Gaussians in the last frame.
        threads: Requested number of threads.
        engine: `fast` or `reference`.
        fps: Frames per second, the first frame left out.
        cpu_ms: Milliseconds of the processor per frame after the first, of all
            threads; on a busy machine it is more reliable than `fps`.
        stolen_share: Share of this machine's busy processor time that its host gave to other
            machines meanwhile; None if the system does not report it.
        ms_by_stage: Milliseconds per frame after the first; what threads do
            side by side adds up to more than a frame takes.
        first_frame_s: From opening the stream to its first frame; for the first stream of a
            process this includes loading libraries.
        warm_first_frame_s: The same when the stream is opened a second time; None for standard
            input.
        peak_rss_mib: Peak memory of this process; None if the system does not report it.
    """

    frames: int
    gaussians: int
    threads: int
    engine: str
    fps: float
    cpu_ms: float
    stolen_share: float | None
    ms_by_stage: dict[str, float]
    first_frame_s: float
    warm_first_frame_s: float | None
    peak_rss_mib: float | None

    def as_json(self) -> dict[str, object]:
        """Return the fields by name."""
        return asdict(self)


def measure_speed(
    name: str, threads: int, on_progress: Callable[[str, int, int], None] | None = None
) -> Speed | None:
    """Play a stream from its beginning to its end.

    Args:
        name: Name of the stream, as for `open_source`.
        threads: As for `Player`.
        on_progress: Called after every frame with stage, done, and 0.

    Returns:
        The measurements; None if the stream has no frames.

    Raises:
        BitstreamError: The stream is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    started = first = last = time.perf_counter()
    cpu, machine = 0.0, None
    frames = gaussians = 0
    before: Counter[str] = Counter()
    with open_source(name) as source, Player(source, threads=threads) as player:
        for frame in player:
            last = time.perf_counter()
            frames, gaussians = frames + 1, frame.scene.count
            if frames == 1:
                first, before, cpu = last, Counter(player.times), time.process_time()
                machine = read_processor_time()
            if on_progress is not None:
                on_progress("decode", frames, 0)
        spent, cpu = Counter(player.times), time.process_time() - cpu
        # Not `-`, which drops a stage that was done with all frames before the first was returned.
        spent.subtract(before)
        machine_now = read_processor_time()
    if frames == 0:
        return None
    peak, warm = measure_peak_mebibytes(), None if name == "-" else _time_first_frame(name, threads)
    moved = max(1, frames - 1)
    return Speed(
        frames,
        gaussians,
        threads,
        choose_engine().name,
        moved / (last - first) if frames > 1 else 0.0,
        1e3 * cpu / moved if frames > 1 else 0.0,
        machine_now.stolen_share(machine) if machine_now and machine else None,
        {stage: nanoseconds / moved / 1e6 for stage, nanoseconds in spent.most_common()},
        first - started,
        warm,
        peak,
    )


def _time_first_frame(name: str, threads: int) -> float:
    started = time.perf_counter()
    with open_source(name) as source, Player(source, threads=threads) as player:
        next(iter(player))
        return time.perf_counter() - started
