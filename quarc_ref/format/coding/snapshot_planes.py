"""Codes snapshots as planes: canonical frames relative to the last CANO (SPEC 8.9).

One walk both encodes and decodes (see `planes`). Surviving Gaussians keep the
Morton order of the CANO, so the previous survivor is a spatial neighbor and has often
moved in the same way. New Gaussians are coded as in a canonical frame.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from quarc_ref.format.arithmetic import bit_length
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.gaussian_planes import (
    read_newborn_gaussians,
    sort_canonical,
    write_canonical,
)
from quarc_ref.format.coding.planes import PlaneReader, Planes, PlaneWriter
from quarc_ref.format.coding.values import code_fixed, code_signed
from quarc_ref.format.constants import (
    AXIS_BITS_LIMIT,
    CLASS_BITS,
    REST_CLASSES,
    ROTATION_INDEX_BITS,
    SURVIVOR_ROWS,
)
from quarc_ref.format.errors import SymbolRangeError
from quarc_ref.format.morton import interleave
from quarc_ref.format.records import Gaussians, Section, SnapshotChunk

# Rows of each field of a survivor, in coding order.
SURVIVOR_FIELDS = {
    "position": slice(0, 3),
    "rotation": slice(3, 7),
    "log-scales": slice(7, 10),
    "opacity": slice(10, 11),
    "SH DC": slice(11, 14),
}


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A decoded snapshot, and the relation of its Gaussians to the last CANO.

    Attributes:
        gaussians: Gaussians of the frame, in Morton order.
        canonical_indices: `[N]` index of each survivor in the CANO; -1 for new Gaussians.
    """

    gaussians: Gaussians
    canonical_indices: Int64


@dataclass(frozen=True, slots=True)
class CodedSnapshot:
    """The contents of a SNAP chunk, and the Gaussians that it represents.

    Attributes:
        newborn_count: Number of Gaussians that are not in the CANO.
        origin: Minimum xyz of the new Gaussians' positions, in position steps.
        axis_bits: Bits per axis of a position relative to the origin.
        survivors: Section of the CANO's surviving Gaussians and their differences.
        sections: Sections of the new Gaussians.
        gaussians: Gaussians of the frame, in Morton order.
    """

    newborn_count: int
    origin: tuple[int, int, int]
    axis_bits: int
    survivors: Section
    sections: tuple[Section, ...]
    gaussians: Gaussians


def write_snapshot(
    canonical: Gaussians, gaussians: Gaussians, canonical_indices: Int64
) -> CodedSnapshot:
    """Encode a frame relative to a canonical frame.

    Args:
        canonical: Gaussians of the CANO, in its Morton order.
        gaussians: Gaussians of the frame, in any order.
        canonical_indices: `[N]` index of each survivor in the CANO, without repetition; -1 for new
            Gaussians. Survivors whose differences are too large to code are coded as new Gaussians.

    Raises:
        EncodeError: Two color codes of a new Gaussian are too far apart.
        SymbolRangeError: The frame is wider than a CANO can represent.
    """
    survivors = np.flatnonzero(canonical_indices >= 0)
    survivors = survivors[np.argsort(canonical_indices[survivors], kind="stable")]
    rows = _subtract_canonical(
        _select_rows(gaussians, survivors), _select_rows(canonical, canonical_indices[survivors])
    )
    is_codable = np.abs(rows).max(axis=0) <= _MAX_DIFFERENCE
    is_codable &= (
        gaussians.codes[_CODES_BEFORE_SH_REST:, survivors]
        == canonical.codes[_CODES_BEFORE_SH_REST:, canonical_indices[survivors]]
    ).all(axis=0)
    survivors = survivors[is_codable]
    lives = np.zeros(canonical.count, dtype=np.bool_)
    lives[canonical_indices[survivors]] = True
    rows_in_canonical_order = np.zeros((SURVIVOR_ROWS, canonical.count), dtype=np.int64)
    rows_in_canonical_order[:, canonical_indices[survivors]] = rows[:, is_codable]
    writer = PlaneWriter(ContextCounts())
    _code_survivors(writer, lives, rows_in_canonical_order)
    is_new = np.ones(canonical_indices.size, dtype=np.bool_)
    is_new[survivors] = False
    newborn, origin, axis_bits = _select_gaussians(gaussians, np.flatnonzero(is_new)), (0, 0, 0), 0
    if newborn.count:
        origin, axis_bits, newborn = sort_canonical(newborn)
    all_gaussians = _concatenate(_select_gaussians(gaussians, survivors), newborn)
    return CodedSnapshot(
        newborn.count,
        origin,
        axis_bits,
        writer.section(),
        write_canonical(newborn, origin),
        _select_gaussians(all_gaussians, _sort_morton(all_gaussians)),
    )


def read_snapshot(
    chunk: SnapshotChunk,
    canonical: Gaussians,
    check_count: Callable[[int], None] = lambda _: None,
) -> Snapshot:
    """Decode a frame that is coded relative to a canonical frame.

    Args:
        chunk: Chunk whose count is within the limit of the stream's level.
        canonical: Gaussians of the CANO, in its Morton order.
        check_count: Function called with the number of Gaussians once it is known, before the new
            Gaussians are decoded.

    Raises:
        EntropyError: A section is malformed, or the frame is wider than a CANO can represent.
    """
    reader = PlaneReader(chunk.survivors, ContextCounts())
    placeholder_lives = np.zeros(canonical.count, dtype=np.bool_)
    placeholder_rows = np.broadcast_to(np.int64(0), (SURVIVOR_ROWS, canonical.count))
    survivor_indices, rows = _code_survivors(reader, placeholder_lives, placeholder_rows)
    reader.finish()
    check_count(survivor_indices.size + chunk.newborn_count)
    survivors = _add_differences(canonical, survivor_indices, rows)
    code_planes = canonical.codes.shape[0]
    newborn = read_newborn_gaussians(chunk, code_planes)
    gaussians = _concatenate(survivors, newborn)
    canonical_indices = np.concatenate(
        [survivor_indices, np.full(newborn.count, -1, dtype=np.int64)]
    )
    order = _sort_morton(gaussians)
    return Snapshot(_select_gaussians(gaussians, order), canonical_indices[order])


def compute_differences(snapshot: Snapshot, canonical: Gaussians) -> Int64:
    """Return the `[SURVIVOR_ROWS, n]` differences of a snapshot's survivors from the CANO."""
    (survivors,) = np.nonzero(snapshot.canonical_indices >= 0)
    canonical_indices = snapshot.canonical_indices[survivors]
    return _subtract_canonical(
        _select_rows(snapshot.gaussians, survivors), _select_rows(canonical, canonical_indices)
    )


def _code_survivors(planes: Planes, lives: Bits, rows: Int64) -> tuple[Int64, Int64]:
    """Code which Gaussians survive (`lives`, `[N]`), then their differences (`rows`).

    Returns:
        The indices `[n]` of the survivors in the CANO, and their `[SURVIVOR_ROWS, n]` rows.
    """
    lives = planes.code("survivors, lives", np.zeros(lives.size, dtype=np.int64), lives)
    survivor_indices = np.flatnonzero(lives)
    rows = rows[:, survivor_indices]
    changed_fields = np.zeros(survivor_indices.size, dtype=np.int64)
    for bit, (name, field) in enumerate(SURVIVOR_FIELDS.items()):
        is_changed = np.any(rows[field], axis=0)
        bits = planes.code(f"survivors, {name}", changed_fields, is_changed)
        changed_fields |= bits.astype(np.int64) << bit
    coded = np.zeros((SURVIVOR_ROWS, survivor_indices.size), dtype=np.int64)
    for bit, (name, field) in enumerate(SURVIVOR_FIELDS.items()):
        changed = np.flatnonzero((changed_fields >> bit) & 1)
        values = rows[field][:, changed]
        if name == "position":
            steps = _code_rows(planes, field, np.diff(values, axis=1, prepend=0))
            coded[field, changed] = np.cumsum(steps, axis=1)
        elif name == "rotation":
            zero_contexts = np.zeros(changed.size, dtype=np.int64)
            largest_indices = code_fixed(
                planes, "survivors, index", zero_contexts, ROTATION_INDEX_BITS, values[0]
            )
            components = slice(field.start + 1, field.stop)
            coded[components, changed] = _code_rows(planes, components, values[1:])
            coded[field.start, changed] = largest_indices
        else:
            coded[field, changed] = _code_rows(planes, field, values)
    return survivor_indices, coded


def _code_rows(planes: Planes, rows: slice, values: Int64) -> Int64:
    """Code rows one by one; contexts depend on the magnitudes in earlier rows of the field."""
    magnitude_sums = np.zeros(values.shape[1], dtype=np.int64)
    coded = np.zeros_like(values)
    for row_index, row in enumerate(range(rows.start, rows.stop)):
        contexts = REST_CLASSES * row + np.minimum(bit_length(magnitude_sums), REST_CLASSES - 1)
        coded[row_index] = code_signed(
            planes, _DIFFERENCES_MODEL, contexts, CLASS_BITS, values[row_index]
        )
        magnitude_sums += np.abs(coded[row_index])
    return coded


def _select_rows(gaussians: Gaussians, indices: Int64) -> Int64:
    """Return the `[SURVIVOR_ROWS, n]` attributes that a snapshot may change."""
    return np.concatenate(
        [
            gaussians.positions[:, indices],
            gaussians.rotations[:, indices],
            gaussians.codes[:_CODES_BEFORE_SH_REST, indices],
        ]
    )


def _subtract_canonical(rows: Int64, canonical_rows: Int64) -> Int64:
    """Return the differences; a rotation whose index differs gets its own components instead."""
    differences = rows - canonical_rows
    index, components = _ROTATION.start, slice(_ROTATION.start + 1, _ROTATION.stop)
    index_changed = differences[index] != 0
    differences[index] %= 1 << ROTATION_INDEX_BITS
    differences[components, index_changed] = rows[components, index_changed]
    return differences


def _add_differences(canonical: Gaussians, survivor_indices: Int64, rows: Int64) -> Gaussians:
    """Add differences to the canonical Gaussians, and return the survivors."""
    sums = _select_rows(canonical, survivor_indices) + rows
    index, components = _ROTATION.start, slice(_ROTATION.start + 1, _ROTATION.stop)
    index_changed = rows[index] != 0
    sums[index] %= 1 << ROTATION_INDEX_BITS
    sums[components, index_changed] = rows[components, index_changed]
    codes = canonical.codes[:, survivor_indices]
    codes[:_CODES_BEFORE_SH_REST] = sums[_ROTATION.stop :]
    return Gaussians(sums[SURVIVOR_FIELDS["position"]], sums[_ROTATION], codes)


def _sort_morton(gaussians: Gaussians) -> Int64:
    """Return the `[n]` indices of Gaussians in Morton order, which is their order in a CANO.

    Raises:
        SymbolRangeError: The frame is wider than a CANO can represent.
    """
    offsets = (
        gaussians.positions - gaussians.positions.min(axis=1, initial=_ABOVE_ALL_POSITIONS)[:, None]
    )
    if offsets.max(initial=0) >> AXIS_BITS_LIMIT:  # [7.9-4]
        message = f"a snapshot is wider than 2^{AXIS_BITS_LIMIT} position steps"
        raise SymbolRangeError(message)
    return np.argsort(interleave(offsets), kind="stable")


def _concatenate(first: Gaussians, second: Gaussians) -> Gaussians:
    return Gaussians(
        np.concatenate([first.positions, second.positions], axis=1),
        np.concatenate([first.rotations, second.rotations], axis=1),
        np.concatenate([first.codes, second.codes], axis=1),
    )


def _select_gaussians(gaussians: Gaussians, indices: Int64) -> Gaussians:
    return Gaussians(
        gaussians.positions[:, indices],
        gaussians.rotations[:, indices],
        gaussians.codes[:, indices],
    )


_DIFFERENCES_MODEL = "survivors, differences"
_ROTATION = SURVIVOR_FIELDS["rotation"]
_CODES_BEFORE_SH_REST = 7  # the first codes of a Gaussian: all but SH rest
_ABOVE_ALL_POSITIONS = 1 << 62
_MAX_DIFFERENCE = (1 << 14) - 1  # so that differences of two such numbers fit Signed(CLASS_BITS)
