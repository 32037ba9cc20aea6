"""Gaussians as planes: the canonical frame (SPEC 8.5) and the newborn (SPEC 8.6).

Each of the two is one walk for both directions (see `planes`). A canonical
frame is coded in Morton order, a section to each subject; the newborn of a
frame are few, so that their rows share contexts and all planes one section.
"""

from collections.abc import Sequence

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import (
    CANONICAL_SECTIONS,
    CLASS_BITS,
    KEY_CLASS_BITS,
    ROTATION_INDEX_BITS,
)
from quarc_ref.format.errors import SymbolRangeError
from quarc_ref.format.morton import deinterleave, interleave
from quarc_ref.format.planes import PlaneReader, Planes, PlaneWriter
from quarc_ref.format.records import (
    LOG_SCALES,
    OPACITY,
    SH_DC,
    SH_REST,
    Births,
    CanonicalChunk,
    Gaussians,
    Section,
)
from quarc_ref.format.values import code_fixed, code_signed, code_unsigned


def sort_canonical(gaussians: Gaussians) -> tuple[tuple[int, int, int], int, Gaussians]:
    """Return origin, axis bits and the Gaussians in Morton order, as CANO wants them.

    Args:
        gaussians: In any order, each axis of positions within 2^20 steps.
    """
    least = gaussians.positions.min(axis=1)
    offsets = gaussians.positions - least[:, None]
    order = np.argsort(interleave(offsets), kind="stable")
    ordered = Gaussians(
        gaussians.positions[:, order], gaussians.rotations[:, order], gaussians.codes[:, order]
    )
    x, y, z = least.tolist()
    return (x, y, z), int(offsets.max()).bit_length(), ordered


def write_canonical(gaussians: Gaussians, origin: tuple[int, int, int]) -> tuple[Section, ...]:
    """Code a canonical frame.

    Args:
        gaussians: In Morton order of position less origin, each axis below 2^20.
        origin: Least xyz, in position steps.

    Returns:
        The sections of a CANO chunk.
    """
    keys = interleave(gaussians.positions - np.array(origin)[:, None])
    writers = [PlaneWriter() for _ in range(CANONICAL_SECTIONS)]
    _walk_canonical(writers, keys, gaussians)
    return tuple(writer.section() for writer in writers)


def read_canonical(chunk: CanonicalChunk, code_planes: int) -> Gaussians:
    """Decode a canonical frame.

    Args:
        chunk: Its count is within the stream's level.
        code_planes: Codes of a Gaussian.

    Returns:
        The Gaussians, in Morton order.

    Raises:
        EntropyError: A section is malformed.
    """
    readers = [PlaneReader(section) for section in chunk.sections]
    blank = _blank(code_planes, chunk.gaussian_count)
    keys, gaussians = _walk_canonical(readers, blank.positions[0], blank)
    for reader in readers:
        reader.finish()
    if keys.min() < 0 or keys.max() >> (3 * chunk.axis_bits):
        message = "a position is outside the canonical frame's box"
        raise SymbolRangeError(message)
    positions = deinterleave(keys) + np.array(chunk.origin, dtype=np.int64)[:, None]
    return Gaussians(positions, gaussians.rotations, gaussians.codes)


def write_births(births: Births) -> Section:
    """Code the newborn of a frame."""
    writer = PlaneWriter()
    _walk_births(writer, births)
    return writer.section()


def read_births(section: Section, code_planes: int, count: int) -> Births:
    """Decode the newborn of a frame.

    Args:
        section: As the FRAM chunk holds it.
        code_planes: Codes of a Gaussian.
        count: How many, within the stream's level.

    Raises:
        EntropyError: The section is malformed.
    """
    reader = PlaneReader(section)
    blank = _blank(code_planes, count)
    births = _walk_births(reader, Births(blank.positions[0], blank))
    reader.finish()
    return births


def _walk_canonical(
    planes: Sequence[Planes], keys: Int64, gaussians: Gaussians
) -> tuple[Int64, Gaussians]:
    """Walk the sections in their order."""
    keys_planes, dc_planes, opacity_planes, scale_planes, rotation_planes, rest_planes = planes
    codes = gaussians.codes
    keys = _code_ascending(keys_planes, KEY_CLASS_BITS, keys)
    dc = _code_rows(dc_planes, codes[SH_DC], apart=True)
    opacity = _code_rows(opacity_planes, codes[OPACITY], apart=True)
    scales = _code_rows(scale_planes, codes[LOG_SCALES], apart=True)
    rotations = _code_rotations(rotation_planes, gaussians.rotations)
    rest = _code_rows(rest_planes, codes[SH_REST], apart=True)
    codes = np.concatenate([scales, opacity, dc, rest])
    return keys, Gaussians(gaussians.positions, rotations, codes)


def _walk_births(planes: Planes, births: Births) -> Births:
    codes = births.residuals.codes
    parents = _code_ascending(planes, KEY_CLASS_BITS, births.parents)
    positions = _code_rows(planes, births.residuals.positions, apart=False)
    dc = _code_rows(planes, codes[SH_DC], apart=False)
    opacity = _code_rows(planes, codes[OPACITY], apart=False)
    scales = _code_rows(planes, codes[LOG_SCALES], apart=False)
    rotations = _code_rotations(planes, births.residuals.rotations)
    rest = _code_rows(planes, codes[SH_REST], apart=False)
    codes = np.concatenate([scales, opacity, dc, rest])
    return Births(parents, Gaussians(positions, rotations, codes))


def _code_ascending(planes: Planes, class_bits: int, values: Int64) -> Int64:
    """Code numbers that ascend, from 0, by their differences."""
    steps = np.diff(values, prepend=0)
    steps = code_unsigned(planes, np.zeros_like(steps), class_bits, steps)
    if steps.max(initial=0) > _STEP_LIMIT:
        message = "a difference of ascending numbers is too large"
        raise SymbolRangeError(message)
    return np.cumsum(steps)


def _code_rows(planes: Planes, rows: Int64, *, apart: bool) -> Int64:
    """Code signed numbers `[r, n]`, a context to each row, or one to all."""
    row_contexts = np.arange(rows.shape[0]) if apart else np.zeros(rows.shape[0], dtype=np.int64)
    contexts = np.repeat(row_contexts, rows.shape[1])
    return code_signed(planes, contexts, CLASS_BITS, rows.reshape(-1)).reshape(rows.shape)


def _code_rotations(planes: Planes, rotations: Int64) -> Int64:
    largest = code_fixed(planes, np.zeros_like(rotations[0]), ROTATION_INDEX_BITS, rotations[0])
    return np.concatenate([largest[None], _code_rows(planes, rotations[1:], apart=False)])


def _blank(code_planes: int, count: int) -> Gaussians:
    """Return what a reader hands to a walk."""
    rows = np.zeros((7 + code_planes, count), dtype=np.int64)
    return Gaussians(rows[:3], rows[3:7], rows[7:])


# A sum of steps that passes 2^63 shows as a negative number on its way.
_STEP_LIMIT = 1 << 60
