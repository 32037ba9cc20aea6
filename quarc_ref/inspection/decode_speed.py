"""Measures decoding speed: frames per second, time by stage, memory, startup time."""

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
    """Decoding speed of a stream whose frames are returned as soon as they are ready.

    Attributes:
        frames: Number of frames, including the first, which is canonical.
        gaussians: Number of Gaussians in the last frame.
        threads: Requested number of threads.
        engine: `fast` or `reference`.
        fps: Frames per second, without the first frame.
        cpu_ms: CPU milliseconds per frame after the first, of all threads; more reliable
            than `fps` on a busy machine.
        stolen_share: Share of the required CPU time that the host gave to other virtual
            machines; None if the system does not report it.
        ms_by_stage: Milliseconds per frame after the first, by stage; the sum exceeds the
            time of a frame if threads run in parallel.
        first_frame_s: Seconds from opening the stream to its first frame, including the
            time to load libraries.
        warm_first_frame_s: Seconds to the first frame when the stream is opened again;
            None for standard input.
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
    """Measure the decoding of a whole stream.

    Args:
        name: Name of the stream for `open_source`.
        threads: Number of threads for `Player`.
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
            frames, gaussians = frames + 1, len(frame.splats.opacities)
            if frames == 1:
                first, before, cpu = last, Counter(player.times), time.process_time()
                machine = read_processor_time()
            if on_progress is not None:
                on_progress("decode", frames, 0)
        spent, cpu = Counter(player.times), time.process_time() - cpu
        # `-` would drop stages that were completed before the first frame was returned.
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
