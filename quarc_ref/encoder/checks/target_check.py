"""Checks whether rate control has reached its target (`--target-kb-per-frame`)."""

from collections.abc import Iterator, Sequence
from statistics import mean

from quarc_ref.datasets.findings import Finding

_MAX_RATIO = 1.1  # of the mean size to the target


def check_target(frame_sizes: Sequence[int], target_kb: float) -> Iterator[Finding]:
    """Yield a finding if frames are larger than their target on average.

    Args:
        frame_sizes: Sizes of the frames that are not keyframes, bytes.
        target_kb: Target of their mean, KB of 1024 bytes; 0 for no target.
    """
    if not target_kb or not frame_sizes:
        return
    mean_kb = mean(frame_sizes) / 1024
    if mean_kb <= _MAX_RATIO * target_kb:
        return
    message = (
        f"frames take {mean_kb:.2f} KB on average, more than the target of {target_kb:g} KB (the "
        f"last frame: {frame_sizes[-1] / 1024:.2f} KB). Rate control needs several frames to "
        "adapt: encode more frames, or choose a lower --quality"
    )
    yield Finding("target-exceeded", message)
