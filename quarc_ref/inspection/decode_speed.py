"""Measures decoding speed: frames per second, time by stage, memory and startup time."""

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
    """Decoding speed of a stream whose frames are decoded without pauses.

    Values per frame or per second are 0 for a stream of one frame.

    Attributes:
        frames: Number of frames, including the first, which is a canonical frame.
        gaussians: Number of Gaussians in the last frame.
        threads: Requested number of threads.
        engine: `fast` or `reference`.
        fps: Frames per second after the first frame.
        cpu_ms: Milliseconds of CPU time per frame after the first frame, summed over all
            threads; more reliable than `fps` on a busy machine.
        stolen_share: Stolen CPU time divided by the CPU time that this machine needed (see
            `stolen_time`); None if the system does not report steal time.
        ms_by_stage: Milliseconds per frame after the first frame, by stage; if threads run in
            parallel, the sum over the stages exceeds the time per frame.
        first_frame_s: Seconds from opening the stream to its first frame, including the
            time to load libraries.
        warm_first_frame_s: Seconds to the first frame when the stream is opened again;
            None for standard input.
        peak_rss_mib: Peak memory of this process, MiB; None if the system does not report it.
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
    """Measure the speed of decoding a whole stream.

    Args:
        name: Path or URL of the stream, or `-`; see `open_source`.
        threads: Number of threads; see `Player`.
        on_progress: Function called after every frame with the stage, the number of frames so
            far, and 0, because the total is unknown.

    Returns:
        The measurements; None if the stream has no frames.

    Raises:
        BitstreamError: The stream is invalid.
        SourceError: The file, pipe or server cannot be read.
    """
    start_time = first_time = last_time = time.perf_counter()
    first_cpu_seconds, first_ticks = 0.0, None
    frame_count = gaussian_count = 0
    first_stage_times: Counter[str] = Counter()
    with open_source(name) as source, Player(source, threads=threads) as player:
        for frame in player:
            last_time = time.perf_counter()
            frame_count, gaussian_count = frame_count + 1, len(frame.splats.opacities)
            if frame_count == 1:
                first_time, first_stage_times = last_time, Counter(player.times)
                first_cpu_seconds = time.process_time()
                first_ticks = read_processor_time()
            if on_progress is not None:
                on_progress("decode", frame_count, 0)
        stage_times, cpu_seconds = Counter(player.times), time.process_time() - first_cpu_seconds
        # `Counter.__sub__` would drop stages whose difference is not positive.
        stage_times.subtract(first_stage_times)
        last_ticks = read_processor_time()
    if frame_count == 0:
        return None
    peak_mib = measure_peak_mebibytes()
    warm_seconds = None if name == "-" else _time_first_frame(name, threads)
    later_frames = max(1, frame_count - 1)
    return Speed(
        frame_count,
        gaussian_count,
        threads,
        choose_engine().name,
        later_frames / (last_time - first_time) if frame_count > 1 else 0.0,
        1e3 * cpu_seconds / later_frames if frame_count > 1 else 0.0,
        last_ticks.stolen_share(first_ticks) if last_ticks and first_ticks else None,
        {
            stage: nanoseconds / later_frames / 1e6
            for stage, nanoseconds in stage_times.most_common()
        },
        first_time - start_time,
        warm_seconds,
        peak_mib,
    )


def _time_first_frame(name: str, threads: int) -> float:
    start_time = time.perf_counter()
    with open_source(name) as source, Player(source, threads=threads) as player:
        next(iter(player))
        return time.perf_counter() - start_time
