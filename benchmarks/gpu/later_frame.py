"""Measures the time of each stage for a frame with as many Gaussians as in the QuARC-GS paper."""

from pathlib import Path

from gpu.plan import REAL_SIZES, Sizes
from gpu.rows import Row, RowLog
from gpu.scene import FRAME_COUNT
from gpu.training import describe_memory, make_config, train
from quarc_ref.decoder.engines import choose_engine
from quarc_ref.streams import decode
from steady_timer import STAGES

_GOAL_SECONDS, _MAX_SECONDS = 2.3, 5.0


def run(sizes: Sizes, folder: Path, row_log: RowLog) -> None:
    """Encode frames with few iterations, and measure the time of the last frame."""
    config = make_config(
        {
            "canonical.iterations": sizes.iterations,
            "canonical.initial_gaussians": sizes.gaussians,
            "canonical.max_gaussians": sizes.gaussians,
            "canonical.densify_until_iter": 0,
            "canonical.half_resolution_until_iter": 0,
            "canonical.prune_rd_lambda": 0,
            "canonical.final_prune_opacity": 0,
            "motion.iterations": sizes.iterations,
            "births.iterations": sizes.iterations,
        }
    )
    training = train(sizes, folder, row_log, config, FRAME_COUNT)
    count = list(decode(training.stream))[-1].count
    seconds = {stage: training.timer.stage_timer.seconds.get(stage, 0.0) for stage in STAGES}
    total_seconds = sum(seconds.values())
    size = f"{count:,} Gaussians, {sizes.width} x {sizes.height}, {sizes.views} views"
    iterations = f"{sizes.iterations} + {sizes.iterations} iterations"
    engine = f"{choose_engine().name} engine"
    row_log.add(
        Row(
            "frame",
            f"time of a frame: {size}, {iterations}, {engine}",
            f"{total_seconds:.2f} s",
            f"goal {_GOAL_SECONDS} s, at most {_MAX_SECONDS} s",
            total_seconds <= _MAX_SECONDS if sizes == REAL_SIZES else None,
            {"seconds": total_seconds, "gaussians": count},
        )
    )
    for stage, stage_seconds in seconds.items():
        row_log.add(
            Row(
                "frame",
                f"time of stage {stage}",
                f"{stage_seconds:.2f} s",
                figures={"seconds": stage_seconds},
            )
        )
    row_log.add(describe_memory("frame", sizes))
