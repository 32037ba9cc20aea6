"""Faults of values: values that can be coded, but that no encoder would write."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hostile.structured.fault import Fault, Stage
from hostile.structured.generator import RecordGenerator, replace_attributes
from hostile.structured.stating_writer import StatingWriter
from quarc_ref.decoder.state import State
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.planes import PlaneWriter
from quarc_ref.format.coding.values import code_unsigned
from quarc_ref.format.constants import (
    CODE_LIMIT,
    KEY_CLASS_BITS,
    PROBABILITY_CODES,
    RESIDUAL_ROWS,
    ROTATION_UNITY_LIMIT,
    SYMBOL_LIMIT,
)
from quarc_ref.format.records import (
    LOG_SCALES,
    SH_DC,
    Births,
    CanonicalChunk,
    Gaussians,
    StreamHeader,
)
from quarc_ref.format.updates import CODES, ROTATION, TRANSLATION, Updates

# Differences of ascending numbers: some are out of range, and the sums of others overflow.
_DIFFERENCES = (1, 1 << 31, 1 << 32, 1 << 59, 1 << 60, (1 << 60) + 1, 1 << 62, (1 << 63) - 1)


def overflow_codes(
    generator: RecordGenerator, gaussians: Gaussians, _header: StreamHeader
) -> Gaussians:
    """Give a Gaussian color codes out of range, although their coded differences are in range."""
    sign = generator.rng.choice((-1, 1))
    limit, excess = sign * CODE_LIMIT, sign * generator.rng.choice((1, 2, CODE_LIMIT))
    codes = gaussians.codes.copy()
    index = generator.rng.randrange(gaussians.count)
    codes[SH_DC, index] = generator.rng.choice(
        (
            [limit + excess, limit, limit],
            [limit, limit, limit + excess],
            [limit + excess, limit, limit - limit],
        )
    )
    return replace(gaussians, codes=codes)


def overflow_rotations(
    generator: RecordGenerator, gaussians: Gaussians, header: StreamHeader
) -> Gaussians:
    """Give a Gaussian three rotation components whose norm exceeds 1."""
    unit = 1 << header.rotation_bits
    index, gaussian = generator.rng.randrange(4), generator.rng.randrange(gaussians.count)
    components = generator.rng.choice(
        ([unit, 1, 0], [unit + 1, 0, 0], [unit, unit, -unit], [-CODE_LIMIT] * 3, [0, 0, CODE_LIMIT])
    )
    return replace_attributes(gaussians, gaussian, rotations=[index, *components])


def cancel_identity_rotation(
    generator: RecordGenerator, symbols: list[Int64], frame_start: State
) -> list[Int64]:
    """Set w residuals that cancel the identity rotation, for all Gaussians or for one anchor."""
    identity = frame_start.scene.header.rotation_unity * frame_start.scene.header.level_count
    new_symbols = [np.zeros_like(level) for level in symbols]
    if generator.rng.random() < 0.5:
        new_symbols[-1][3] = -identity
    else:
        new_symbols[0][3, generator.rng.randrange(new_symbols[0].shape[1])] = -identity
    return new_symbols


def move_far(generator: RecordGenerator, symbols: list[Int64], _frame_start: State) -> list[Int64]:
    """Move all Gaussians along one axis by the largest symbol of every level."""
    axis, sign = generator.rng.randrange(3), generator.rng.choice((-1, 1))
    for level in symbols:
        level[axis] = sign * SYMBOL_LIMIT
    return symbols


def rotate_randomly(
    generator: RecordGenerator, symbols: list[Int64], _frame_start: State
) -> list[Int64]:
    """Rotate all Gaussians by random residuals from the full range."""
    for level in symbols:
        level[3:] = generator.array_rng.integers(-SYMBOL_LIMIT, SYMBOL_LIMIT + 1, level[3:].shape)
    return symbols


def delete_all(_generator: RecordGenerator, _updates: Updates, moved_frame: State) -> Updates:
    """Return updates that delete all Gaussians."""
    count = moved_frame.scene.count
    zero_residuals = np.zeros((RESIDUAL_ROWS, count), dtype=np.int64)
    return Updates(np.arange(count), np.ones(count, dtype=np.bool_), zero_residuals)


def update_by_largest_residuals(
    generator: RecordGenerator, _updates: Updates, moved_frame: State
) -> Updates:
    """Return an update that moves a Gaussian, or changes its codes, by the largest residuals."""
    updates = _make_zero_update(generator, moved_frame)
    rows = generator.rng.choice((TRANSLATION, CODES))
    updates.residuals[rows] = generator.rng.choice((-CODE_LIMIT, CODE_LIMIT))
    return updates


def rotate_by_large_update(
    generator: RecordGenerator, _updates: Updates, moved_frame: State
) -> Updates:
    """Return an update that rotates a Gaussian by the largest valid residual, or a larger one."""
    updates = _make_zero_update(generator, moved_frame)
    limit = ROTATION_UNITY_LIMIT
    residual = generator.rng.choice((limit, limit + 1, -limit - 1, CODE_LIMIT))
    updates.residuals[ROTATION.start + generator.rng.randrange(3)] = residual
    return updates


def _make_zero_update(generator: RecordGenerator, moved_frame: State) -> Updates:
    indices = np.array([generator.rng.randrange(moved_frame.scene.count)])
    return Updates(indices, np.zeros(1, np.bool_), np.zeros((RESIDUAL_ROWS, 1), dtype=np.int64))


def use_missing_parents(generator: RecordGenerator, births: Births, moved_frame: State) -> Births:
    """Set parents to indices above the largest index, some of which need more than 64 bits."""
    count = moved_frame.scene.count
    differences = np.zeros_like(births.parents)
    differences[generator.rng.randrange(differences.size)] = generator.rng.choice(
        (count, count + 1, *_DIFFERENCES[1:])
    )
    if generator.rng.random() < 0.2:
        differences[:] = generator.rng.choice(_DIFFERENCES)
    return replace(births, parents=np.cumsum(differences))


def place_births_far(generator: RecordGenerator, births: Births, _moved_frame: State) -> Births:
    """Place births as far from their parents as their codes allow."""
    positions = generator.array_rng.choice(
        [-CODE_LIMIT, CODE_LIMIT], births.newborn.positions.shape
    )
    return replace(births, newborn=replace(births.newborn, positions=positions))


def overflow_birth_codes(generator: RecordGenerator, births: Births, moved_frame: State) -> Births:
    """Give a new Gaussian codes out of range, although their coded differences are in range."""
    if generator.rng.random() < 0.5:
        return replace(
            births, newborn=overflow_codes(generator, births.newborn, moved_frame.scene.header)
        )
    codes = births.newborn.codes.copy()
    index = generator.rng.randrange(births.newborn.count)
    codes[LOG_SCALES, index] = [CODE_LIMIT, CODE_LIMIT + 1, 2 * CODE_LIMIT + 1]
    return replace(births, newborn=replace(births.newborn, codes=codes))


def overflow_birth_rotations(
    generator: RecordGenerator, births: Births, moved_frame: State
) -> Births:
    """Give a new Gaussian a rotation whose components have a norm above 1."""
    newborn = overflow_rotations(generator, births.newborn, moved_frame.scene.header)
    return replace(births, newborn=newborn)


def overflow_keys(generator: RecordGenerator, chunk: CanonicalChunk) -> CanonicalChunk:
    """Code Morton keys of positions outside the box, or keys that exceed 64 bits."""
    differences = generator.array_rng.choice([0, 0, 1], chunk.gaussian_count)
    for _ in range(generator.rng.choice((1, 1, 4))):
        differences[generator.rng.randrange(differences.size)] = generator.rng.choice(_DIFFERENCES)
    writer = PlaneWriter(ContextCounts())
    code_unsigned(writer, "keys", np.zeros_like(differences), KEY_CLASS_BITS, differences)
    axis_bits = generator.rng.choice((chunk.axis_bits, 20))
    return replace(chunk, axis_bits=axis_bits, sections=(writer.section(), *chunk.sections[1:]))


def open_random_writer(generator: RecordGenerator, counts: ContextCounts) -> StatingWriter:
    """Return a writer that states random probabilities."""
    return _open_stating_writer(generator, counts, range(PROBABILITY_CODES))


def open_undefined_code_writer(generator: RecordGenerator, counts: ContextCounts) -> StatingWriter:
    """Return a writer that states probabilities by random codes, some of which are undefined."""
    return _open_stating_writer(generator, counts, range(generator.rng.choice((0, 200)), 256))


def _open_stating_writer(
    generator: RecordGenerator, counts: ContextCounts, codes: range
) -> StatingWriter:
    return StatingWriter(counts, type(generator.rng)(generator.rng.getrandbits(64)), codes)


VALUE_FAULTS: Sequence[Fault] = (
    Fault("codes out of range", Stage.SCENE, overflow_codes),
    Fault("rotation norms above 1", Stage.SCENE, overflow_rotations),
    Fault(
        *("canceled identity rotation", Stage.MOTION, cancel_identity_rotation),
        {"rotation_components": 4, "rotation_unity": 3},
    ),
    Fault("largest motion symbols", Stage.MOTION, move_far),
    Fault("motion out of the lattice", Stage.MOTION, move_far, {"translation_step": (1 << 16) - 1}),
    Fault("large rotations", Stage.MOTION, rotate_randomly, {"rotation_unity": 1}),
    Fault("updates delete all Gaussians", Stage.UPDATES, delete_all, {"updates": True}),
    Fault("largest updates", Stage.UPDATES, update_by_largest_residuals, {"updates": True}),
    Fault(
        *("updates out of the lattice", Stage.UPDATES, update_by_largest_residuals),
        {"updates": True, "translation_step": (1 << 16) - 1},
    ),
    Fault(
        "update rotations out of range", Stage.UPDATES, rotate_by_large_update, {"updates": True}
    ),
    Fault("missing parents", Stage.BIRTHS, use_missing_parents),
    Fault("births far from their parents", Stage.BIRTHS, place_births_far),
    Fault(
        "births out of the lattice",
        Stage.BIRTHS,
        place_births_far,
        {"position_step": (1 << 16) - 1},
    ),
    Fault("birth codes out of range", Stage.BIRTHS, overflow_birth_codes),
    Fault("birth rotation norms above 1", Stage.BIRTHS, overflow_birth_rotations),
    Fault("Morton keys outside the box", Stage.CANONICAL, overflow_keys),
    Fault("random stated probabilities", Stage.WRITER, open_random_writer),
    Fault("undefined probability codes", Stage.WRITER, open_undefined_code_writer),
)
