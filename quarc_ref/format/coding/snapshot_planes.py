"""Codes snapshots as planes: canonical frames relative to the last CANO (SPEC 8.9).

One walk serves both encoding and decoding (see `planes`). Surviving Gaussians keep the
Morton order of the CANO, so the previous one is a spatial neighbor and has often moved in
the same way. All others are coded as in a canonical frame.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.format.arithmetic import bit_length
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.gaussian_planes import read_newborn, sort_canonical, write_canonical
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
    """A canonical frame, and its relation to the last CANO.

    Attributes:
        gaussians: Gaussians of the frame, in its order.
        roots: `[N]` index in the CANO of each survivor; -1 for the others.
    """

    gaussians: Gaussians
    roots: Int64


@dataclass(frozen=True, slots=True)
class CodedSnapshot:
    """Contents of a SNAP chunk.

    Attributes:
        newborn_count: Number of Gaussians that are not in the CANO.
        origin: Minimum xyz of their positions, in position steps.
        axis_bits: Number of bits of a position minus the origin.
        survivors: Section of the surviving Gaussians of the CANO.
        sections: Sections of the new Gaussians.
        gaussians: Gaussians of the frame, in its order.
    """

    newborn_count: int
    origin: tuple[int, int, int]
    axis_bits: int
    survivors: Section
    sections: tuple[Section, ...]
    gaussians: Gaussians


def write_snapshot(canonical: Gaussians, gaussians: Gaussians, roots: Int64) -> CodedSnapshot:
    """Code a frame relative to a canonical frame.

    Args:
        canonical: Gaussians of the CANO, in its order.
        gaussians: Gaussians of the frame, in any order.
        roots: `[N]` distinct indices in the CANO of the survivors; -1 for the others.
            Survivors that have changed too much are coded as new.

    Raises:
        EncodeError: Two colors of a new Gaussian are too far apart.
        SymbolRangeError: The frame is wider than a CANO can represent.
    """
    order = np.flatnonzero(roots >= 0)
    order = order[np.argsort(roots[order], kind="stable")]
    rows = _subtract(_rows_of(gaussians, order), _rows_of(canonical, roots[order]))
    near = np.abs(rows).max(axis=0) <= _MAX_CHANGE
    near &= (gaussians.codes[_CODES:, order] == canonical.codes[_CODES:, roots[order]]).all(axis=0)
    order = order[near]
    lives = np.zeros(canonical.count, dtype=np.bool_)
    lives[roots[order]] = True
    spread = np.zeros((SURVIVOR_ROWS, canonical.count), dtype=np.int64)
    spread[:, roots[order]] = rows[:, near]
    writer = PlaneWriter(ContextCounts())
    _code_survivors(writer, lives, spread)
    left = np.ones(roots.size, dtype=np.bool_)
    left[order] = False
    newborn, origin, axis_bits = _take(gaussians, np.flatnonzero(left)), (0, 0, 0), 0
    if newborn.count:
        origin, axis_bits, newborn = sort_canonical(newborn)
    whole = _join(_take(gaussians, order), newborn)
    return CodedSnapshot(
        newborn.count,
        origin,
        axis_bits,
        writer.section(),
        write_canonical(newborn, origin),
        _take(whole, _sort(whole)),
    )


def read_snapshot(chunk: SnapshotChunk, canonical: Gaussians) -> Snapshot:
    """Decode a frame that is coded relative to a canonical frame.

    Args:
        chunk: Chunk with a count within the stream's level.
        canonical: Gaussians of the CANO, in its order.

    Raises:
        EntropyError: A section is malformed, or the frame is too wide.
    """
    reader = PlaneReader(chunk.survivors, ContextCounts())
    nothing = np.zeros(canonical.count, dtype=np.bool_)
    blank = np.broadcast_to(np.int64(0), (SURVIVOR_ROWS, canonical.count))
    kept, rows = _code_survivors(reader, nothing, blank)
    reader.finish()
    survivors = _add(canonical, kept, rows)
    code_planes = canonical.codes.shape[0]
    newborn = read_newborn(chunk, code_planes)
    gaussians = _join(survivors, newborn)
    roots = np.concatenate([kept, np.full(newborn.count, -1, dtype=np.int64)])
    order = _sort(gaussians)
    return Snapshot(_take(gaussians, order), roots[order])


def compare(snapshot: Snapshot, canonical: Gaussians) -> Int64:
    """Return the `[SURVIVOR_ROWS, n]` differences of a snapshot's survivors from their CANO."""
    (here,) = np.nonzero(snapshot.roots >= 0)
    roots = snapshot.roots[here]
    return _subtract(_rows_of(snapshot.gaussians, here), _rows_of(canonical, roots))


def _code_survivors(planes: Planes, lives: Bits, rows: Int64) -> tuple[Int64, Int64]:
    """Walk the planes: `lives` is `[N]`, `rows` `[SURVIVOR_ROWS, N]`.

    Returns:
        The indices `[n]` of the survivors, and their rows.
    """
    lives = planes.code("survivors, lives", np.zeros(lives.size, dtype=np.int64), lives)
    kept = np.flatnonzero(lives)
    rows = rows[:, kept]
    answers = np.zeros(kept.size, dtype=np.int64)
    for number, (name, field) in enumerate(SURVIVOR_FIELDS.items()):
        differs = np.any(rows[field], axis=0)
        bits = planes.code(f"survivors, {name}", answers, differs)
        answers |= bits.astype(np.int64) << number
    coded = np.zeros((SURVIVOR_ROWS, kept.size), dtype=np.int64)
    for number, (name, field) in enumerate(SURVIVOR_FIELDS.items()):
        there = np.flatnonzero((answers >> number) & 1)
        values = rows[field][:, there]
        if name == "position":
            steps = _code_rows(planes, field, np.diff(values, axis=1, prepend=0))
            coded[field, there] = np.cumsum(steps, axis=1)
        elif name == "rotation":
            zeros = np.zeros(there.size, dtype=np.int64)
            turned = code_fixed(planes, "survivors, index", zeros, ROTATION_INDEX_BITS, values[0])
            others = slice(field.start + 1, field.stop)
            coded[others, there] = _code_rows(planes, others, values[1:])
            coded[field.start, there] = turned
        else:
            coded[field, there] = _code_rows(planes, field, values)
    return kept, coded


def _code_rows(planes: Planes, rows: slice, values: Int64) -> Int64:
    """Code rows one by one, with the magnitudes of the previous field's rows as context."""
    so_far = np.zeros(values.shape[1], dtype=np.int64)
    coded = np.zeros_like(values)
    for place, row in enumerate(range(rows.start, rows.stop)):
        contexts = REST_CLASSES * row + np.minimum(bit_length(so_far), REST_CLASSES - 1)
        coded[place] = code_signed(planes, _VALUES, contexts, CLASS_BITS, values[place])
        so_far += np.abs(coded[place])
    return coded


def _rows_of(gaussians: Gaussians, which: Int64) -> Int64:
    """Return the `[SURVIVOR_ROWS, n]` values of Gaussians that may differ."""
    return np.concatenate(
        [
            gaussians.positions[:, which],
            gaussians.rotations[:, which],
            gaussians.codes[:_CODES, which],
        ]
    )


def _subtract(rows: Int64, before: Int64) -> Int64:
    """Return differences, or the components of rotations with a different index."""
    differences = rows - before
    index, components = _ROTATION.start, slice(_ROTATION.start + 1, _ROTATION.stop)
    turned = differences[index] != 0
    differences[index] %= 1 << ROTATION_INDEX_BITS
    differences[components, turned] = rows[components, turned]
    return differences


def _add(canonical: Gaussians, kept: Int64, rows: Int64) -> Gaussians:
    """Add differences to the canonical Gaussians, and return the survivors."""
    sums = _rows_of(canonical, kept) + rows
    index, components = _ROTATION.start, slice(_ROTATION.start + 1, _ROTATION.stop)
    turned = rows[index] != 0
    sums[index] %= 1 << ROTATION_INDEX_BITS
    sums[components, turned] = rows[components, turned]
    codes = canonical.codes[:, kept]
    codes[:_CODES] = sums[_ROTATION.stop :]
    return Gaussians(sums[SURVIVOR_FIELDS["position"]], sums[_ROTATION], codes)


def _sort(gaussians: Gaussians) -> Int64:
    """Return the Morton order of the Gaussians of a frame, as in a CANO.

    Raises:
        SymbolRangeError: The frame is wider than a CANO can represent.
    """
    offsets = gaussians.positions - gaussians.positions.min(axis=1, initial=_FAR)[:, None]
    if offsets.max(initial=0) >> AXIS_BITS_LIMIT:  # [7.9-4]
        message = f"a snapshot is wider than 2^{AXIS_BITS_LIMIT} steps"
        raise SymbolRangeError(message)
    return np.argsort(interleave(offsets), kind="stable")


def _join(first: Gaussians, second: Gaussians) -> Gaussians:
    return Gaussians(
        np.concatenate([first.positions, second.positions], axis=1),
        np.concatenate([first.rotations, second.rotations], axis=1),
        np.concatenate([first.codes, second.codes], axis=1),
    )


def _take(gaussians: Gaussians, which: Int64) -> Gaussians:
    return Gaussians(
        gaussians.positions[:, which], gaussians.rotations[:, which], gaussians.codes[:, which]
    )


_VALUES = "survivors, differences"
_ROTATION = SURVIVOR_FIELDS["rotation"]
_CODES = 7  # the first codes of a Gaussian: all but SH rest
_FAR = 1 << 62
_MAX_CHANGE = (1 << 14) - 1  # so that the difference of two numbers fits Signed(CLASS_BITS)
