"""Matches rows of two frames that differ little, although all their attributes may change.

Methods that train all attributes in every frame usually keep the order of their rows: they remove
some, and append others.
"""

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.format.arrays import Bits, Int64

# Largest plausible motion in a frame, relative to the scale of a Gaussian.
_MAX_RELATIVE_MOTION = 10.0
# Largest change of a log scale, an opacity or SH DC between similar rows.
_MAX_SIMILAR_CHANGE = 0.5
# Numbers of rows that are compared at a time, and among which the next run is sought.
_MIN_WINDOW, _MAX_WINDOW = 32, 512
_MAX_FAILURES = 1000  # rows after which no next run was found
_MAX_COLOR_CHANGE = 1.0  # largest plausible change of SH DC; it changes colors (0 to 1) by 0.28


def match_similar(previous: Splats, current: Splats) -> tuple[Int64, Int64]:
    """Match runs of similar rows, skipping deaths and births between them."""
    counts = len(previous.positions), len(current.positions)
    first, second = 0, 0
    window, failure_count = _MIN_WINDOW, 0
    runs = [(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))]
    # Frames with rows in another order have no runs, and are not searched to their end.
    while first < counts[0] and second < counts[1] and failure_count < _MAX_FAILURES:
        offsets = np.arange(min(window, counts[0] - first, counts[1] - second))
        is_similar = _is_similar(previous, first + offsets, current, second + offsets)
        length = int(offsets.size if is_similar.all() else is_similar.argmin())
        runs.append((first + offsets[:length], second + offsets[:length]))
        first, second = first + length, second + length
        window = min(2 * window, _MAX_WINDOW)
        if length < offsets.size:
            deaths, births = _find_next_run(previous, first, current, second)
            first, second = first + deaths, second + births
            window = _MIN_WINDOW
            failure_count += deaths == births
    first_rows, second_rows = (np.concatenate(columns) for columns in zip(*runs, strict=True))
    return first_rows, second_rows


def _find_next_run(previous: Splats, first: int, current: Splats, second: int) -> tuple[int, int]:
    """Return how many rows to skip in each frame until two consecutive pairs are similar.

    Rows are skipped in only one of the frames, as few as possible; if this does not lead to such
    pairs, one row is skipped in both.
    """
    first_end = len(previous.positions) - 1 - first
    second_end = len(current.positions) - 1 - second
    for window in (_MIN_WINDOW, _MAX_WINDOW):
        skipped: list[tuple[int, int]] = []
        for in_first, in_second in ((1, 0), (0, 1)):
            steps = np.arange(1, min(window, first_end if in_first else second_end))
            if not steps.size or min(first_end, second_end) < 1:
                continue
            first_rows, second_rows = first + in_first * steps, second + in_second * steps
            is_run = _is_similar(previous, first_rows, current, second_rows)
            is_run[is_run] = _is_similar(
                previous, first_rows[is_run] + 1, current, second_rows[is_run] + 1
            )
            if is_run.any():
                count = int(steps[is_run.argmax()])
                skipped.append((in_first * count, in_second * count))
        if skipped:
            return min(skipped, key=sum)
    return 1, 1


def _is_similar(previous: Splats, first_rows: Int64, current: Splats, second_rows: Int64) -> Bits:
    """Return a mask `[n]` of row pairs that may match and whose attributes differ little."""
    is_similar = is_plausible(previous, first_rows, current, second_rows)
    for values, other_values in (
        (previous.log_scales, current.log_scales),
        (previous.opacities[:, None], current.opacities[:, None]),
        (previous.sh[:, 0], current.sh[:, 0]),
    ):
        changes = np.abs(other_values[second_rows].astype(np.float64) - values[first_rows])
        is_similar &= (changes <= _MAX_SIMILAR_CHANGE).all(axis=1)
    return is_similar


def is_plausible(previous: Splats, first_rows: Int64, current: Splats, second_rows: Int64) -> Bits:
    """Return a mask `[n]` of row pairs whose positions and colors are close enough to match."""
    distances = np.abs(current.positions[second_rows] - previous.positions[first_rows]).max(axis=1)
    max_distances = _MAX_RELATIVE_MOTION * np.exp(
        np.minimum(previous.log_scales[first_rows].max(axis=1), 30.0)
    )
    color_changes = np.abs(current.sh[second_rows, 0] - previous.sh[first_rows, 0]).max(axis=1)
    is_plausible: Bits = (distances <= max_distances) & (color_changes <= _MAX_COLOR_CHANGE)
    return is_plausible
