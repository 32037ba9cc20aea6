"""Codes updates of individual Gaussians as planes: SPEC 8.8.

One walk serves both encoding and decoding (see `planes`). Most Gaussians of a frame do
not change. The first plane covers all Gaussians; the others cover the few that change.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.format.arrays import Bits, Int16, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.planes import PlaneReader, Planes, PlaneWriter
from quarc_ref.format.coding.values import code_signed
from quarc_ref.format.constants import (
    CLASS_BITS,
    CODE_LIMIT,
    RECENCY_LIMIT,
    RESIDUAL_ROWS,
    ROTATION_UNITY_LIMIT,
)
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import Section
from quarc_ref.format.updates import ROTATION, UPDATE_FIELDS, Updates


@dataclass(frozen=True, slots=True, eq=False)
class UpdateContext:
    """Context of the Gaussians of a frame before its updates.

    Attributes:
        motion: `[c, N]` motion of each Gaussian in this frame: the sum of the symbols of
            all levels.
        recency: `[N]` frames since each Gaussian was updated or added, at most RECENCY_LIMIT.
    """

    motion: Int16
    recency: Int16


def write_updates(context: UpdateContext, updates: Updates, counts: ContextCounts) -> Section:
    """Code the updates of a frame.

    Args:
        context: Context of the frame.
        updates: Updates of the frame.
        counts: Counts of the contexts before the frame.

    Raises:
        EncodeError: A residual is out of the format's range.
    """
    if np.abs(updates.residuals[ROTATION]).max(initial=0) > ROTATION_UNITY_LIMIT:
        message = f"a rotation residual exceeds {ROTATION_UNITY_LIMIT}"
        raise EncodeError(message)
    if np.abs(updates.residuals).max(initial=0) > CODE_LIMIT:
        message = f"a residual of an update exceeds {CODE_LIMIT}: increase the step"
        raise EncodeError(message)
    count = context.recency.size
    changes, dies = np.zeros((2, count), dtype=np.bool_)
    changes[updates.gaussians] = True
    dies[updates.gaussians] = updates.dies
    residuals = np.zeros((RESIDUAL_ROWS, count), dtype=np.int64)
    residuals[:, updates.gaussians] = updates.residuals
    writer = PlaneWriter(counts)
    _code_updates(writer, context, changes, dies, residuals)
    return writer.section()


def read_updates(
    section: Section, context: UpdateContext, counts: ContextCounts
) -> tuple[Updates, ContextCounts]:
    """Decode the updates of a frame.

    Args:
        section: Section of the FRAM chunk.
        context: Context of the frame.
        counts: Counts of the contexts before the frame.

    Returns:
        The updates, and the updated counts.

    Raises:
        EntropyError: The section is malformed.
    """
    count = context.recency.size
    reader = PlaneReader(section, counts)
    nothing = np.zeros(count, dtype=np.bool_)
    residuals = np.broadcast_to(np.int64(0), (RESIDUAL_ROWS, count))
    updates = _code_updates(reader, context, nothing, nothing, residuals)
    return updates, reader.finish()


def _code_updates(
    planes: Planes, context: UpdateContext, changes: Bits, dies: Bits, residuals: Int64
) -> Updates:
    """Walk the planes: `changes` and `dies` are `[N]`, `residuals` `[RESIDUAL_ROWS, N]`."""
    changes = planes.code("updates, changes", _changes_contexts(context), changes)
    chosen = np.flatnonzero(changes)
    dying = planes.code("updates, dies", context.recency[chosen].astype(np.int64), dies[chosen])
    coded = np.zeros((RESIDUAL_ROWS, chosen.size), dtype=np.int64)
    left = np.flatnonzero(~dying)
    coded[:, left] = _code_fields(planes, residuals[:, chosen[left]])
    return Updates(chosen, dying, coded)


def _changes_contexts(context: UpdateContext) -> Int64:
    """Return `[N]` contexts 4 M + R from the motion (M) and recency (R) of each Gaussian."""
    contexts = context.recency.astype(np.int64)
    moved = np.flatnonzero(np.bitwise_or.reduce(context.motion, axis=0))
    far = np.abs(context.motion[:, moved]).sum(axis=0, dtype=np.int64)
    contexts[moved] += (RECENCY_LIMIT + 1) * (1 + (far > 1) + (far > _FAR))
    return contexts


def _code_fields(planes: Planes, residuals: Int64) -> Int64:
    """Code which fields of Gaussians change, then the residuals `[RESIDUAL_ROWS, n]`."""
    before = np.zeros(residuals.shape[1], dtype=np.int64)
    for number, (name, rows) in enumerate(UPDATE_FIELDS.items()):
        differs = np.any(residuals[rows], axis=0)
        before |= planes.code(f"updates, {name}", before, differs).astype(np.int64) << number
    coded = np.zeros_like(residuals)
    for number, rows in enumerate(UPDATE_FIELDS.values()):
        there = np.flatnonzero((before >> number) & 1)
        so_far = np.zeros(there.size, dtype=np.int64)
        for row in range(rows.start, rows.stop):
            contexts = 3 * row + 1 + np.sign(so_far)
            values = residuals[row, there]
            coded[row, there] = code_signed(planes, _VALUES, contexts, CLASS_BITS, values)
            so_far += coded[row, there]
    return coded


_VALUES = "updates, residuals"
_FAR = 3
