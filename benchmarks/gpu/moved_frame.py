"""Times a frame of the paper's size by stage."""

from pathlib import Path

from gpu.plan import REAL, Sizes
from gpu.rows import Notebook, Row
from gpu.scene import FRAMES
from gpu.training import describe_memory, make_config, train
from quarc_ref.streams import decode
from steady_timer import STAGES

_GOAL, _BAR = 2.3, 5.0


def work(sizes: Sizes, folder: Path, notebook: Notebook) -> None:
    """Encode frames with as many Gaussians as points, hardly trained, and time the last one."""
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
    done = train(sizes, folder, notebook, config, FRAMES)
    count = list(decode(done.stream))[-1].count
    seconds = {stage: done.timer.timer.seconds.get(stage, 0.0) for stage in STAGES}
    whole = sum(seconds.values())
    size = f"{count:,} Gaussians, {sizes.width} x {sizes.height}, {sizes.views} views"
    iterations = f"{sizes.iterations} + {sizes.iterations} iterations"
    notebook.add(
        Row(
            "frame",
            f"a frame: {size}, {iterations}",
            f"{whole:.2f} s",
            f"goal {_GOAL} s, bar {_BAR} s",
            whole <= _BAR if sizes == REAL else None,
            {"seconds": whole, "gaussians": count},
        )
    )
    for stage, spent in seconds.items():
        notebook.add(Row("frame", f"of it {stage}", f"{spent:.2f} s", figures={"seconds": spent}))
    notebook.add(describe_memory("frame", sizes))
