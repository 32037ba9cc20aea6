"""Codes Gaussians as planes: canonical frames (SPEC 8.5) and births (SPEC 8.6).

Canonical frames and births each have one walk, which both encodes and decodes (see
`planes`). A canonical frame is coded in Morton order, with one section per attribute and new
contexts in each section. A frame has few births, so all their attributes share one section, whose
contexts continue from previous frames.
"""

from collections.abc import Sequence

import numpy as np

from quarc_ref.format.arithmetic import bit_length
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.planes import PlaneReader, Planes, PlaneWriter
from quarc_ref.format.coding.values import code_fixed, code_signed, code_unsigned
from quarc_ref.format.constants import (
    CANONICAL_SECTIONS,
    CLASS_BITS,
    CODE_LIMIT,
    KEY_CLASS_BITS,
    REST_CLASSES,
    ROTATION_INDEX_BITS,
)
from quarc_ref.format.errors import EncodeError, SymbolRangeError
from quarc_ref.format.morton import deinterleave, interleave
from quarc_ref.format.records import (
    LOG_SCALES,
    OPACITY,
    SH_DC,
    SH_REST,
    Births,
    CanonicalChunk,
    Gaussians,
    Section,
    SnapshotChunk,
)


def order_canonical(positions: Int64, origin: Int64 | None = None) -> Int64:
    """Return the `[n]` indices of Gaussians in the Morton order of a canonical frame.

    Args:
        positions: `[3, n]` positions in steps.
        origin: `[3]` lower corner of the frame's box, from which positions are below 2^20 on each
            axis; None for the smallest box.
    """
    offsets = positions - (positions.min(axis=1) if origin is None else origin)[:, None]
    return np.argsort(interleave(offsets), kind="stable")


def sort_canonical(
    gaussians: Gaussians, origin: Int64 | None = None
) -> tuple[tuple[int, int, int], int, Gaussians]:
    """Return the origin and axis bits of a canonical frame, and its Gaussians in Morton order.

    Args:
        gaussians: Gaussians in any order.
        origin: See `order_canonical`.
    """
    if origin is None:
        origin = gaussians.positions.min(axis=1)
    order = order_canonical(gaussians.positions, origin)
    ordered = Gaussians(
        gaussians.positions[:, order], gaussians.rotations[:, order], gaussians.codes[:, order]
    )
    x, y, z = origin.tolist()
    widest_range = int((gaussians.positions - origin[:, None]).max())
    return (x, y, z), widest_range.bit_length(), ordered


def write_canonical(gaussians: Gaussians, origin: tuple[int, int, int]) -> tuple[Section, ...]:
    """Encode a canonical frame.

    Args:
        gaussians: Gaussians in the Morton order of their positions relative to `origin`, which
            are below 2^20 on each axis.
        origin: Minimum xyz, in position steps.

    Returns:
        The sections of a CANO chunk.

    Raises:
        EncodeError: Two color codes of a Gaussian are too far apart.
    """
    keys = interleave(gaussians.positions - np.array(origin)[:, None])
    writers = [PlaneWriter(ContextCounts()) for _ in range(CANONICAL_SECTIONS)]
    _code_canonical(writers, keys, gaussians)
    return tuple(writer.section() for writer in writers)


def read_canonical(chunk: CanonicalChunk, code_planes: int) -> Gaussians:
    """Decode a canonical frame.

    Args:
        chunk: Chunk whose count is within the limit of the stream's level.
        code_planes: Number of codes of a Gaussian.

    Returns:
        The Gaussians, in Morton order.

    Raises:
        EntropyError: A section is malformed.
    """
    return _read_sections(chunk, chunk.gaussian_count, code_planes)


def read_newborn_gaussians(chunk: SnapshotChunk, code_planes: int) -> Gaussians:
    """Decode the Gaussians of a snapshot that are not in its canonical frame."""
    return _read_sections(chunk, chunk.newborn_count, code_planes)


def _read_sections(
    chunk: CanonicalChunk | SnapshotChunk, count: int, code_planes: int
) -> Gaussians:
    readers = [PlaneReader(section, ContextCounts()) for section in chunk.sections]
    placeholder = _make_placeholder_gaussians(code_planes, count)
    keys, gaussians = _code_canonical(readers, placeholder.positions[0], placeholder)
    for reader in readers:
        reader.finish()
    if keys.min(initial=0) < 0 or keys.max(initial=0) >> (3 * chunk.axis_bits):  # [8.5-1]
        message = "a position is outside the bounding box of the canonical frame"
        raise SymbolRangeError(message)
    positions = deinterleave(keys) + np.array(chunk.origin, dtype=np.int64)[:, None]
    return Gaussians(positions, gaussians.rotations, gaussians.codes)


def write_births(births: Births, counts: ContextCounts) -> Section:
    """Encode the births of a frame.

    Args:
        births: Births, in ascending order of parents.
        counts: Current counts of the contexts.

    Raises:
        EncodeError: Two color or log-scale codes of a new Gaussian are too far apart.
    """
    writer = PlaneWriter(counts)
    _code_births(writer, births)
    return writer.section()


def read_births(
    section: Section, code_planes: int, count: int, counts: ContextCounts
) -> tuple[Births, ContextCounts]:
    """Decode the births of a frame.

    Args:
        section: Section of the FRAM chunk.
        code_planes: Number of codes of a Gaussian.
        count: Number of births, within the limit of the stream's level.
        counts: Current counts of the contexts.

    Returns:
        The births, and the updated counts.

    Raises:
        EntropyError: The section is malformed.
    """
    reader = PlaneReader(section, counts)
    placeholder = _make_placeholder_gaussians(code_planes, count)
    births = _code_births(reader, Births(placeholder.positions[0], placeholder))
    return births, reader.finish()


def _code_canonical(
    planes: Sequence[Planes], keys: Int64, gaussians: Gaussians
) -> tuple[Int64, Gaussians]:
    """Code the planes of all sections, which are independent of each other (SPEC 8.5)."""
    (
        position_planes,
        color_planes,
        opacity_planes,
        log_scale_planes,
        rotation_planes,
        sh_rest_planes,
    ) = planes
    codes = gaussians.codes
    keys = code_ascending(position_planes, "keys", keys)
    sh_dc = _code_colors(color_planes, "SH DC", codes[SH_DC])
    opacity = _code_rows(opacity_planes, "opacity", codes[OPACITY])
    log_scales = _code_rows(log_scale_planes, "log-scales", codes[LOG_SCALES])
    rotations = _code_rotations(rotation_planes, "rotations", gaussians.rotations)
    sh_rest = _code_sh_rest(sh_rest_planes, "SH rest", codes[SH_REST])
    codes = np.concatenate([log_scales, opacity, sh_dc, sh_rest])
    return keys, Gaussians(gaussians.positions, rotations, codes)


def _code_births(planes: Planes, births: Births) -> Births:
    codes = births.newborn.codes
    parents = code_ascending(planes, "births parents", births.parents)
    positions = _code_rows_in_one_context(planes, "births positions", births.newborn.positions)
    sh_dc = _code_colors(planes, "births SH DC", codes[SH_DC])
    opacity = _code_rows(planes, "births opacity", codes[OPACITY])
    log_scales = _code_rows(planes, "births log-scales", _row_differences(codes[LOG_SCALES]))
    log_scales = np.cumsum(log_scales, axis=0)
    rotations = _code_rotations(planes, "births rotations", births.newborn.rotations)
    sh_rest = _code_rows_in_one_context(planes, "births SH rest", codes[SH_REST])
    codes = np.concatenate([log_scales, opacity, sh_dc, sh_rest])
    return Births(parents, Gaussians(positions, rotations, codes))


def code_ascending(planes: Planes, name: str, values: Int64) -> Int64:
    """Code ascending non-negative numbers `[n]` as differences (SPEC 8.4).

    Raises:
        SymbolRangeError: When reading, a difference exceeds 2^60.
    """
    differences = np.diff(values, prepend=0)
    differences = code_unsigned(
        planes, name, np.zeros_like(differences), KEY_CLASS_BITS, differences
    )
    if differences.max(initial=0) > _DIFFERENCE_LIMIT:  # [8.4-1]
        message = "the difference between two ascending numbers is too large"
        raise SymbolRangeError(message)
    return np.cumsum(differences)


def _code_rows(planes: Planes, name: str, rows: Int64) -> Int64:
    """Code signed numbers `[r, n]` with one context per row."""
    contexts = np.repeat(np.arange(rows.shape[0]), rows.shape[1])
    return _code_sequence(planes, name, contexts, rows)


def _code_rows_in_one_context(planes: Planes, name: str, rows: Int64) -> Int64:
    """Code signed numbers `[r, n]` with one context for all rows."""
    return _code_sequence(planes, name, np.zeros(rows.size, dtype=np.int64), rows)


def _code_sequence(planes: Planes, name: str, contexts: Int64, rows: Int64) -> Int64:
    if np.any(np.abs(rows) > CODE_LIMIT):
        message = f"two codes of a Gaussian are more than {CODE_LIMIT} apart: "
        message += "increase the quantization step"
        raise EncodeError(message)
    return code_signed(planes, name, contexts, CLASS_BITS, rows.reshape(-1)).reshape(rows.shape)


def _code_colors(planes: Planes, name: str, rows: Int64) -> Int64:
    """Code red, green and blue as green, red minus green, and blue minus green."""
    red, green, blue = rows
    coded = _code_rows(planes, name, np.stack([green, red - green, blue - green]))
    green, red, blue = coded[0], coded[0] + coded[1], coded[0] + coded[2]
    return np.stack([red, green, blue])


def _code_rotations(planes: Planes, name: str, rotations: Int64) -> Int64:
    contexts = np.zeros_like(rotations[0])
    largest_indices = code_fixed(
        planes, f"{name}, index", contexts, ROTATION_INDEX_BITS, rotations[0]
    )
    return np.concatenate([largest_indices[None], _code_rows(planes, name, rotations[1:])])


def _code_sh_rest(planes: Planes, name: str, rows: Int64) -> Int64:
    """Code rows one by one; contexts depend on the magnitudes in earlier rows."""
    magnitude_sums = np.zeros(rows.shape[1], dtype=np.int64)
    coded = np.zeros_like(rows)
    for row_index, row in enumerate(rows):
        contexts = (
            REST_CLASSES * row_index
            + _MAGNITUDE_CLASSES[np.minimum(magnitude_sums, _MAGNITUDE_CLASSES.size - 1)]
        )
        coded[row_index] = code_signed(planes, name, contexts, CLASS_BITS, row)
        magnitude_sums += np.abs(coded[row_index])
    return coded


def _row_differences(rows: Int64) -> Int64:
    """Return each row minus the row before it; the first row is unchanged."""
    return np.diff(rows, axis=0, prepend=0)


def _make_placeholder_gaussians(code_planes: int, count: int) -> Gaussians:
    """Return Gaussians whose values are all 0; a walk that decodes ignores the values."""
    rows = np.zeros((7 + code_planes, count), dtype=np.int64)
    return Gaussians(rows[:3], rows[3:7], rows[7:])


# Class of each sum of magnitudes; larger sums are in the last class.
_MAGNITUDE_CLASSES = bit_length(np.arange(1 << (REST_CLASSES - 1)))
# Up to this difference, a sum that overflows int64 becomes negative and is rejected.
_DIFFERENCE_LIMIT = 1 << 60
