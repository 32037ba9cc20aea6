"""Matches the Gaussians of consecutive frames by ids or by order.

Without ids, row i of a frame matches row i of the next frame if both frames have the same number
of rows and most of these pairs are plausible. If this is not the case, landmarks are matched
first: rows whose attributes, except position and rotation, are equal in both frames and unique
in each frame. If most rows have no such landmark, because a method trains all attributes in every
frame, rows that differ little are landmarks, in runs between which rows were removed or added.
Rows between two landmarks are matched in order. Unmatched rows are deaths or births.
"""

from bisect import bisect_left
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.encoder.scenes.similar_rows import is_plausible, match_similar
from quarc_ref.format.arrays import Int64


@dataclass(frozen=True, slots=True, eq=False)
class Match:
    """Pairs of rows that represent the same Gaussians in two frames.

    Attributes:
        first_rows: `[m]` rows in the first frame.
        second_rows: `[m]` rows in the second frame, without duplicates.
    """

    first_rows: Int64
    second_rows: Int64


class FrameToMatch(Protocol):
    """A frame with Gaussians, and their ids if it has any."""

    @property
    def splats(self) -> Splats:
        """The Gaussians."""

    @property
    def ids(self) -> Int64 | None:
        """`[N]` unique ids of the Gaussians."""


def match_frames(previous_frame: FrameToMatch, frame: FrameToMatch) -> Match:
    """Match the Gaussians of two frames: by ids if both frames have ids, otherwise by order."""
    if previous_frame.ids is not None and frame.ids is not None:
        return match_ids(previous_frame.ids, frame.ids)
    return match_order(previous_frame.splats, frame.splats)


def match_ids(previous_ids: Int64, ids: Int64) -> Match:
    """Match the rows of two frames by ids, which must be unique in each frame."""
    _, first_rows, second_rows = np.intersect1d(
        previous_ids, ids, assume_unique=True, return_indices=True
    )
    order = np.argsort(first_rows)
    return Match(first_rows[order], second_rows[order])


def match_order(previous: Splats, current: Splats) -> Match:
    """Match the rows of two frames without ids, as the module docstring describes."""
    count = len(previous.positions)
    if count == len(current.positions):
        first_rows = np.arange(count)
        if np.mean(is_plausible(previous, first_rows, current, first_rows)) > 0.5:
            return Match(first_rows, first_rows)
    first_landmarks, second_landmarks = _match_landmarks(previous, current)
    if 2 * first_landmarks.size < min(count, len(current.positions)):
        similar_rows = match_similar(previous, current)
        if similar_rows[0].size > first_landmarks.size:
            first_landmarks, second_landmarks = similar_rows
    gap_bounds = zip(
        np.concatenate([[-1], first_landmarks]),
        np.concatenate([first_landmarks, [count]]),
        np.concatenate([[-1], second_landmarks]),
        np.concatenate([second_landmarks, [len(current.positions)]]),
        strict=True,
    )
    pairs = [(first_landmarks, second_landmarks)]
    for first_low, first_high, second_low, second_high in gap_bounds:
        if first_high - first_low > 1 and second_high - second_low > 1:
            pairs.append(
                _match_gap(
                    previous, (first_low + 1, first_high), current, (second_low + 1, second_high)
                )
            )
    first_rows, second_rows = (np.concatenate(columns) for columns in zip(*pairs, strict=True))
    order = np.argsort(first_rows)
    return Match(first_rows[order], second_rows[order])


def _match_landmarks(previous: Splats, current: Splats) -> tuple[Int64, Int64]:
    """Match rows whose attributes are equal and unique in each frame, keeping the row order."""
    sh_count = min(previous.sh.shape[1], current.sh.shape[1])  # SH degrees may differ
    keys = np.concatenate(
        [_pack_attributes(previous, sh_count), _pack_attributes(current, sh_count)]
    )
    _, labels, counts = np.unique(keys, return_inverse=True, return_counts=True)
    labels = labels.reshape(-1)
    previous_count = len(previous.positions)
    unique_rows = [
        np.flatnonzero(np.bincount(frame_labels, minlength=counts.size)[frame_labels] == 1)
        for frame_labels in (labels[:previous_count], labels[previous_count:])
    ]
    _, first_indices, second_indices = np.intersect1d(
        labels[:previous_count][unique_rows[0]],
        labels[previous_count:][unique_rows[1]],
        return_indices=True,
    )
    first_rows, second_rows = unique_rows[0][first_indices], unique_rows[1][second_indices]
    order = np.argsort(first_rows)
    increasing_indices = _longest_increasing_subsequence(second_rows[order])
    return first_rows[order][increasing_indices], second_rows[order][increasing_indices]


def _pack_attributes(splats: Splats, sh_count: int) -> NDArray[np.void]:
    """Pack all attributes except position and rotation into one item per Gaussian, `[N]`.

    Args:
        splats: Gaussians of a frame.
        sh_count: Number of SH coefficients to include.
    """
    sh = splats.sh[:, :sh_count].reshape(len(splats.sh), -1)
    table = np.hstack([splats.log_scales, splats.opacities[:, None], sh])
    packed = np.ascontiguousarray(table, dtype="<f4") + np.float32(0)  # replaces -0 by 0
    return packed.view(np.dtype((np.void, packed.itemsize * packed.shape[1]))).reshape(-1)


def _longest_increasing_subsequence(numbers: Int64) -> Int64:
    """Return the indices of a longest increasing subsequence."""
    if np.all(np.diff(numbers) > 0):
        return np.arange(numbers.size)
    tail_values: list[int] = []
    tail_indices: list[int] = []
    predecessors = np.full(numbers.size, -1, dtype=np.int64)
    for index, number in enumerate(numbers.tolist()):
        length = bisect_left(tail_values, number)
        if length:
            predecessors[index] = tail_indices[length - 1]
        if length == len(tail_values):
            tail_values.append(number)
            tail_indices.append(index)
        else:
            tail_values[length], tail_indices[length] = number, index
    reversed_subsequence = [tail_indices[-1]] if tail_indices else []
    while reversed_subsequence and predecessors[reversed_subsequence[-1]] >= 0:
        reversed_subsequence.append(int(predecessors[reversed_subsequence[-1]]))
    return np.array(reversed_subsequence[::-1], dtype=np.int64)


def _match_gap(
    previous: Splats, first_range: tuple[int, int], current: Splats, second_range: tuple[int, int]
) -> tuple[Int64, Int64]:
    """Match the rows between two landmarks in order.

    If both ranges have the same length, only implausible pairs are dropped. If the lengths
    differ, the first implausible pair and all pairs after it are dropped.
    """
    first_rows, second_rows = np.arange(*first_range), np.arange(*second_range)
    count = min(first_rows.size, second_rows.size)
    first_rows, second_rows = first_rows[:count], second_rows[:count]
    if first_range[1] - first_range[0] == second_range[1] - second_range[0]:
        is_kept = is_plausible(previous, first_rows, current, second_rows)
    else:
        is_kept = np.logical_and.accumulate(
            is_plausible(previous, first_rows, current, second_rows)
        )
    return first_rows[is_kept], second_rows[is_kept]
