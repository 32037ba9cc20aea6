"""Faults of values: values that can be coded but that no encoder writes."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hostile.structured.draws import Draws, replace_columns
from hostile.structured.fault import Fault, Stage
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
_STEPS = (1, 1 << 31, 1 << 32, 1 << 59, 1 << 60, (1 << 60) + 1, 1 << 62, (1 << 63) - 1)


def overflow_codes(draws: Draws, gaussians: Gaussians, _header: StreamHeader) -> Gaussians:
    """Give a Gaussian a color out of range whose coded differences are in range."""
    sign = draws.rng.choice((-1, 1))
    limit, excess = sign * CODE_LIMIT, sign * draws.rng.choice((1, 2, CODE_LIMIT))
    codes = gaussians.codes.copy()
    index = draws.rng.randrange(gaussians.count)
    codes[SH_DC, index] = draws.rng.choice(
        (
            [limit + excess, limit, limit],
            [limit, limit, limit + excess],
            [limit + excess, limit, limit - limit],
        )
    )
    return replace(gaussians, codes=codes)


def overflow_rotations(draws: Draws, gaussians: Gaussians, header: StreamHeader) -> Gaussians:
    """Give a Gaussian three rotation components whose norm exceeds 1."""
    unit = 1 << header.rotation_bits
    index, gaussian = draws.rng.randrange(4), draws.rng.randrange(gaussians.count)
    components = draws.rng.choice(
        ([unit, 1, 0], [unit + 1, 0, 0], [unit, unit, -unit], [-CODE_LIMIT] * 3, [0, 0, CODE_LIMIT])
    )
    return replace_columns(gaussians, gaussian, rotations=[index, *components])


def degenerate_rotations(draws: Draws, symbols: list[Int64], frame_start: State) -> list[Int64]:
    """Make the w residuals cancel the identity rotation, for all Gaussians or for one anchor."""
    identity = frame_start.scene.header.rotation_unity * frame_start.scene.header.level_count
    new_symbols = [np.zeros_like(level) for level in symbols]
    if draws.rng.random() < 0.5:
        new_symbols[-1][3] = -identity
    else:
        new_symbols[0][3, draws.rng.randrange(new_symbols[0].shape[1])] = -identity
    return new_symbols


def move_far(draws: Draws, symbols: list[Int64], _frame_start: State) -> list[Int64]:
    """Move all Gaussians along one axis by the largest symbol of every level."""
    axis, sign = draws.rng.randrange(3), draws.rng.choice((-1, 1))
    for level in symbols:
        level[axis] = sign * SYMBOL_LIMIT
    return symbols


def rotate_far(draws: Draws, symbols: list[Int64], _frame_start: State) -> list[Int64]:
    """Rotate all Gaussians by random residuals from the full range."""
    for level in symbols:
        level[3:] = draws.array_rng.integers(-SYMBOL_LIMIT, SYMBOL_LIMIT + 1, level[3:].shape)
    return symbols


def delete_all(_draws: Draws, _updates: Updates, moved_frame: State) -> Updates:
    """Return updates that delete all Gaussians."""
    count = moved_frame.scene.count
    zero_residuals = np.zeros((RESIDUAL_ROWS, count), dtype=np.int64)
    return Updates(np.arange(count), np.ones(count, dtype=np.bool_), zero_residuals)


def update_too_far(draws: Draws, _updates: Updates, moved_frame: State) -> Updates:
    """Return an update that moves a Gaussian, or changes its codes, by the largest residuals."""
    updates = _make_zero_update(draws, moved_frame)
    rows = draws.rng.choice((TRANSLATION, CODES))
    updates.residuals[rows] = draws.rng.choice((-CODE_LIMIT, CODE_LIMIT))
    return updates


def rotate_too_far(draws: Draws, _updates: Updates, moved_frame: State) -> Updates:
    """Return an update that rotates a Gaussian by the largest valid residual, or a larger one."""
    updates = _make_zero_update(draws, moved_frame)
    limit = ROTATION_UNITY_LIMIT
    residual = draws.rng.choice((limit, limit + 1, -limit - 1, CODE_LIMIT))
    updates.residuals[ROTATION.start + draws.rng.randrange(3)] = residual
    return updates


def _make_zero_update(draws: Draws, moved_frame: State) -> Updates:
    indices = np.array([draws.rng.randrange(moved_frame.scene.count)])
    return Updates(indices, np.zeros(1, np.bool_), np.zeros((RESIDUAL_ROWS, 1), dtype=np.int64))


def use_missing_parents(draws: Draws, births: Births, moved_frame: State) -> Births:
    """Set parents to indices just above or far above the largest index, or above 64 bits."""
    count = moved_frame.scene.count
    steps = np.zeros_like(births.parents)
    steps[draws.rng.randrange(steps.size)] = draws.rng.choice((count, count + 1, *_STEPS[1:]))
    if draws.rng.random() < 0.2:
        steps[:] = draws.rng.choice(_STEPS)
    return replace(births, parents=np.cumsum(steps))


def place_births_far(draws: Draws, births: Births, _moved_frame: State) -> Births:
    """Place births as far from their parents as their codes allow."""
    positions = draws.array_rng.choice([-CODE_LIMIT, CODE_LIMIT], births.newborn.positions.shape)
    return replace(births, newborn=replace(births.newborn, positions=positions))


def overflow_birth_codes(draws: Draws, births: Births, moved_frame: State) -> Births:
    """Give a new Gaussian codes out of range whose coded differences are in range."""
    if draws.rng.random() < 0.5:
        return replace(
            births, newborn=overflow_codes(draws, births.newborn, moved_frame.scene.header)
        )
    codes = births.newborn.codes.copy()
    index = draws.rng.randrange(births.newborn.count)
    codes[LOG_SCALES, index] = [CODE_LIMIT, CODE_LIMIT + 1, 2 * CODE_LIMIT + 1]
    return replace(births, newborn=replace(births.newborn, codes=codes))


def overflow_birth_rotations(draws: Draws, births: Births, moved_frame: State) -> Births:
    """Give a new Gaussian a rotation whose components have a norm above 1."""
    newborn = overflow_rotations(draws, births.newborn, moved_frame.scene.header)
    return replace(births, newborn=newborn)


def overflow_keys(draws: Draws, chunk: CanonicalChunk) -> CanonicalChunk:
    """Code Morton keys that are outside the box, or that exceed 64 bits."""
    steps = draws.array_rng.choice([0, 0, 1], chunk.gaussian_count)
    for _ in range(draws.rng.choice((1, 1, 4))):
        steps[draws.rng.randrange(steps.size)] = draws.rng.choice(_STEPS)
    writer = PlaneWriter(ContextCounts())
    code_unsigned(writer, "keys", np.zeros_like(steps), KEY_CLASS_BITS, steps)
    axis_bits = draws.rng.choice((chunk.axis_bits, 20))
    return replace(chunk, axis_bits=axis_bits, sections=(writer.section(), *chunk.sections[1:]))


def state_random_codes(draws: Draws, counts: ContextCounts) -> StatingWriter:
    """Return a writer that states random probabilities."""
    return _open_stating_writer(draws, counts, range(PROBABILITY_CODES))


def state_undefined_codes(draws: Draws, counts: ContextCounts) -> StatingWriter:
    """Return a writer that states random probabilities, some of them by undefined codes."""
    return _open_stating_writer(draws, counts, range(draws.rng.choice((0, 200)), 256))


def _open_stating_writer(draws: Draws, counts: ContextCounts, codes: range) -> StatingWriter:
    return StatingWriter(counts, type(draws.rng)(draws.rng.getrandbits(64)), codes)


HOSTILE_VALUES: Sequence[Fault] = (
    Fault("codes out of range", Stage.SCENE, overflow_codes),
    Fault("rotation norms above 1", Stage.SCENE, overflow_rotations),
    Fault(
        *("canceled identity rotation", Stage.MOTION, degenerate_rotations),
        {"rotation_components": 4, "rotation_unity": 3},
    ),
    Fault("largest motion symbols", Stage.MOTION, move_far),
    Fault("motion out of the lattice", Stage.MOTION, move_far, {"translation_step": (1 << 16) - 1}),
    Fault("large rotations", Stage.MOTION, rotate_far, {"rotation_unity": 1}),
    Fault("updates delete all Gaussians", Stage.UPDATES, delete_all, {"updates": True}),
    Fault("largest updates", Stage.UPDATES, update_too_far, {"updates": True}),
    Fault(
        *("updates out of the lattice", Stage.UPDATES, update_too_far),
        {"updates": True, "translation_step": (1 << 16) - 1},
    ),
    Fault("update rotations out of range", Stage.UPDATES, rotate_too_far, {"updates": True}),
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
    Fault("random stated probabilities", Stage.WRITER, state_random_codes),
    Fault("undefined probability codes", Stage.WRITER, state_undefined_codes),
)
