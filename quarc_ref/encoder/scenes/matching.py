"""Matches the Gaussians of consecutive frames by ids or by order.

Without ids, Gaussians are matched by row. If frames have different numbers of
rows, rows that are unique and equal except for position and rotation are landmarks; between two
landmarks, runs of equal length are matched in order. Unmatched rows are deaths or births.
"""

from bisect import bisect_left
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.format.arrays import Bits, Int64

_FAR = 10.0  # largest plausible motion in a frame, relative to the scale of a Gaussian
_RECOLORED = 1.0  # difference of SH DC: 0.28 of a color from 0 to 1


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Rows of the same Gaussians in two frames.

    Attributes:
        before: `[m]` rows in the first frame.
        after: `[m]` rows in the second frame, without duplicates.
    """

    before: Int64
    after: Int64


def match_ids(before: Int64, after: Int64) -> Match:
    """Match rows by ids, which are unique in each frame."""
    _, first, second = np.intersect1d(before, after, assume_unique=True, return_indices=True)
    order = np.argsort(first)
    return Match(first[order], second[order])


def match_order(before: Splats, after: Splats) -> Match:
    """Match rows by order."""
    count = len(before.positions)
    if count == len(after.positions):
        rows = np.arange(count)
        if np.mean(_is_plausible(before, rows, after, rows)) > 0.5:
            return Match(rows, rows)
    first, second = _match_landmarks(before, after)
    borders = zip(
        np.concatenate([[-1], first]),
        np.concatenate([first, [count]]),
        np.concatenate([[-1], second]),
        np.concatenate([second, [len(after.positions)]]),
        strict=True,
    )
    pairs = [(first, second)]
    for low, high, other_low, other_high in borders:
        if high - low > 1 and other_high - other_low > 1:
            pairs.append(_match_gap(before, (low + 1, high), after, (other_low + 1, other_high)))
    rows, others = (np.concatenate(each) for each in zip(*pairs, strict=True))
    order = np.argsort(rows)
    return Match(rows[order], others[order])


def _match_landmarks(before: Splats, after: Splats) -> tuple[Int64, Int64]:
    """Match rows whose attributes are unique in both frames, in the same order."""
    keys = np.concatenate([_describe(before), _describe(after)])
    _, names, counts = np.unique(keys, return_inverse=True, return_counts=True)
    names = names.reshape(-1)
    split = len(before.positions)
    singles = [
        np.flatnonzero(np.bincount(part, minlength=counts.size)[part] == 1)
        for part in (names[:split], names[split:])
    ]
    _, first, second = np.intersect1d(
        names[:split][singles[0]], names[split:][singles[1]], return_indices=True
    )
    rows, others = singles[0][first], singles[1][second]
    order = np.argsort(rows)
    kept = _longest_ascent(others[order])
    return rows[order][kept], others[order][kept]


def _describe(splats: Splats) -> NDArray[np.void]:
    """Return `[N]` items with all attributes of a Gaussian except position and rotation."""
    table = np.hstack(
        [splats.log_scales, splats.opacities[:, None], splats.sh.reshape(len(splats.sh), -1)]
    )
    packed = np.ascontiguousarray(table, dtype="<f4") + np.float32(0)  # replaces -0 by 0
    return packed.view(np.dtype((np.void, packed.itemsize * packed.shape[1]))).reshape(-1)


def _longest_ascent(numbers: Int64) -> Int64:
    """Return the indices of a longest ascending subsequence."""
    if np.all(np.diff(numbers) > 0):
        return np.arange(numbers.size)
    ends: list[int] = []
    last: list[int] = []
    links = np.full(numbers.size, -1, dtype=np.int64)
    for index, number in enumerate(numbers.tolist()):
        place = bisect_left(ends, number)
        if place:
            links[index] = last[place - 1]
        if place == len(ends):
            ends.append(number)
            last.append(index)
        else:
            ends[place], last[place] = number, index
    chain = [last[-1]] if last else []
    while chain and links[chain[-1]] >= 0:
        chain.append(int(links[chain[-1]]))
    return np.array(chain[::-1], dtype=np.int64)


def _match_gap(
    before: Splats, rows: tuple[int, int], after: Splats, others: tuple[int, int]
) -> tuple[Int64, Int64]:
    """Match the rows between two landmarks from the front."""
    first, second = np.arange(*rows), np.arange(*others)
    count = min(first.size, second.size)
    first, second = first[:count], second[:count]
    if rows[1] - rows[0] == others[1] - others[0]:
        kept = _is_plausible(before, first, after, second)
    else:
        kept = np.logical_and.accumulate(_is_plausible(before, first, after, second))
    return first[kept], second[kept]


def _is_plausible(before: Splats, rows: Int64, after: Splats, others: Int64) -> Bits:
    """Return `[n]` whether position and color allow Gaussians to be the same."""
    moved = np.abs(after.positions[others] - before.positions[rows]).max(axis=1)
    reach = _FAR * np.exp(np.minimum(before.log_scales[rows].max(axis=1), 30.0))
    recolored = np.abs(after.sh[others, 0] - before.sh[rows, 0]).max(axis=1)
    plausible: Bits = (moved <= reach) & (recolored <= _RECOLORED)
    return plausible
