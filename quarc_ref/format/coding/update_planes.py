"""Codes updates of individual Gaussians as planes: SPEC 8.8.

One walk both encodes and decodes (see `planes`). Most Gaussians of a frame do not change, so
only the first plane has a bit for every Gaussian; the others cover those that change.
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
    """Data about the Gaussians of a frame that is known before its updates are coded.

    Attributes:
        motion: `[c, N]` motion of each Gaussian in this frame: the sum of the symbols of
            all levels.
        recency: `[N]` number of frames since each Gaussian was updated or added, at most
            RECENCY_LIMIT.
    """

    motion: Int16
    recency: Int16


def write_updates(context: UpdateContext, updates: Updates, counts: ContextCounts) -> Section:
    """Encode the updates of a frame.

    Args:
        context: Motion and recency of the frame's Gaussians.
        updates: Updates of the frame.
        counts: Counts of the contexts before the frame.

    Raises:
        EncodeError: A residual is out of the format's range.
    """
    if np.abs(updates.residuals[ROTATION]).max(initial=0) > ROTATION_UNITY_LIMIT:
        message = f"a rotation residual of an update exceeds {ROTATION_UNITY_LIMIT}"
        raise EncodeError(message)
    if np.abs(updates.residuals).max(initial=0) > CODE_LIMIT:
        message = f"a residual of an update exceeds {CODE_LIMIT}: increase the quantization step"
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
        context: Motion and recency of the frame's Gaussians.
        counts: Counts of the contexts before the frame.

    Returns:
        The updates, and the counts after the frame.

    Raises:
        EntropyError: The section is malformed.
    """
    count = context.recency.size
    reader = PlaneReader(section, counts)
    placeholder_bits = np.zeros(count, dtype=np.bool_)
    residuals = np.broadcast_to(np.int64(0), (RESIDUAL_ROWS, count))
    updates = _code_updates(reader, context, placeholder_bits, placeholder_bits, residuals)
    return updates, reader.finish()


def _code_updates(
    planes: Planes, context: UpdateContext, changes: Bits, dies: Bits, residuals: Int64
) -> Updates:
    """Code the planes of `changes` `[N]`, `dies` `[N]` and `residuals` `[RESIDUAL_ROWS, N]`."""
    changes = planes.code("updates, changes", _change_contexts(context), changes)
    changed = np.flatnonzero(changes)
    is_dying = planes.code(
        "updates, dies", context.recency[changed].astype(np.int64), dies[changed]
    )
    coded = np.zeros((RESIDUAL_ROWS, changed.size), dtype=np.int64)
    surviving = np.flatnonzero(~is_dying)
    coded[:, surviving] = _code_fields(planes, residuals[:, changed[surviving]])
    return Updates(changed, is_dying, coded)


def _change_contexts(context: UpdateContext) -> Int64:
    """Return the `[N]` contexts 4 M + R, with motion class M and recency R of each Gaussian."""
    contexts = context.recency.astype(np.int64)
    moved = np.flatnonzero(np.bitwise_or.reduce(context.motion, axis=0))
    motion_sums = np.abs(context.motion[:, moved]).sum(axis=0, dtype=np.int64)
    contexts[moved] += (RECENCY_LIMIT + 1) * (1 + (motion_sums > 1) + (motion_sums > _LARGE_MOTION))
    return contexts


def _code_fields(planes: Planes, residuals: Int64) -> Int64:
    """Code which fields of Gaussians change, then the residuals `[RESIDUAL_ROWS, n]`."""
    changed_fields = np.zeros(residuals.shape[1], dtype=np.int64)
    for bit, (name, rows) in enumerate(UPDATE_FIELDS.items()):
        is_changed = np.any(residuals[rows], axis=0)
        changed_fields |= (
            planes.code(f"updates, {name}", changed_fields, is_changed).astype(np.int64) << bit
        )
    coded = np.zeros_like(residuals)
    for bit, rows in enumerate(UPDATE_FIELDS.values()):
        changed = np.flatnonzero((changed_fields >> bit) & 1)
        residual_sums = np.zeros(changed.size, dtype=np.int64)
        for row in range(rows.start, rows.stop):
            contexts = 3 * row + 1 + np.sign(residual_sums)
            values = residuals[row, changed]
            coded[row, changed] = code_signed(
                planes, _RESIDUALS_MODEL, contexts, CLASS_BITS, values
            )
            residual_sums += coded[row, changed]
    return coded


_RESIDUALS_MODEL = "updates, residuals"
_LARGE_MOTION = 3
