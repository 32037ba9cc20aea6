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

# Differences of ascending numbers: some are out of range, and some have a sum that overflows.
_STEPS = (1, 1 << 31, 1 << 32, 1 << 59, 1 << 60, (1 << 60) + 1, 1 << 62, (1 << 63) - 1)


def overflow_codes(draws: Draws, gaussians: Gaussians, _header: StreamHeader) -> Gaussians:
    """Give a Gaussian a color that is out of range, while its coded differences are in range."""
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
    """Make the residuals of w of all Gaussians, or of one anchor, cancel the identity."""
    identity = frame_start.scene.header.rotation_unity * frame_start.scene.header.level_count
    new_symbols = [np.zeros_like(level) for level in symbols]
    if draws.rng.random() < 0.5:
        new_symbols[-1][3] = -identity
    else:
        new_symbols[0][3, draws.rng.randrange(new_symbols[0].shape[1])] = -identity
    return new_symbols


def move_far(draws: Draws, symbols: list[Int64], _frame_start: State) -> list[Int64]:
    """Move all Gaussians along an axis, by the largest symbols at every level."""
    axis, sign = draws.rng.randrange(3), draws.rng.choice((-1, 1))
    for level in symbols:
        level[axis] = sign * SYMBOL_LIMIT
    return symbols


def rotate_far(draws: Draws, symbols: list[Int64], _frame_start: State) -> list[Int64]:
    """Rotate all Gaussians by residuals of any size."""
    for level in symbols:
        level[3:] = draws.array_rng.integers(-SYMBOL_LIMIT, SYMBOL_LIMIT + 1, level[3:].shape)
    return symbols


def delete_all(_draws: Draws, _updates: Updates, moved_frame: State) -> Updates:
    """Delete all Gaussians by updates."""
    count = moved_frame.scene.count
    zero_residuals = np.zeros((RESIDUAL_ROWS, count), dtype=np.int64)
    return Updates(np.arange(count), np.ones(count, dtype=np.bool_), zero_residuals)


def update_too_far(draws: Draws, _updates: Updates, moved_frame: State) -> Updates:
    """Move a Gaussian, or change its codes, by the largest residuals."""
    updates = _make_zero_update(draws, moved_frame)
    rows = draws.rng.choice((TRANSLATION, CODES))
    updates.residuals[rows] = draws.rng.choice((-CODE_LIMIT, CODE_LIMIT))
    return updates


def rotate_too_far(draws: Draws, _updates: Updates, moved_frame: State) -> Updates:
    """Rotate a Gaussian by the largest valid residual, or by a larger one."""
    updates = _make_zero_update(draws, moved_frame)
    limit = ROTATION_UNITY_LIMIT
    residual = draws.rng.choice((limit, limit + 1, -limit - 1, CODE_LIMIT))
    updates.residuals[ROTATION.start + draws.rng.randrange(3)] = residual
    return updates


def _make_zero_update(draws: Draws, moved_frame: State) -> Updates:
    indices = np.array([draws.rng.randrange(moved_frame.scene.count)])
    return Updates(indices, np.zeros(1, np.bool_), np.zeros((RESIDUAL_ROWS, 1), dtype=np.int64))


def use_missing_parents(draws: Draws, births: Births, moved_frame: State) -> Births:
    """Set parents to indices that exceed the scene by a little, by much, or exceed 64 bits."""
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
    """Give a birth codes that are out of range, while their coded differences are in range."""
    if draws.rng.random() < 0.5:
        return replace(
            births, newborn=overflow_codes(draws, births.newborn, moved_frame.scene.header)
        )
    codes = births.newborn.codes.copy()
    index = draws.rng.randrange(births.newborn.count)
    codes[LOG_SCALES, index] = [CODE_LIMIT, CODE_LIMIT + 1, 2 * CODE_LIMIT + 1]
    return replace(births, newborn=replace(births.newborn, codes=codes))


def overflow_birth_rotations(draws: Draws, births: Births, moved_frame: State) -> Births:
    """Give a birth a rotation whose components have a norm above 1."""
    newborn = overflow_rotations(draws, births.newborn, moved_frame.scene.header)
    return replace(births, newborn=newborn)


def overflow_keys(draws: Draws, chunk: CanonicalChunk) -> CanonicalChunk:
    """Code Morton keys outside the box, or whose sum exceeds 64 bits."""
    steps = draws.array_rng.choice([0, 0, 1], chunk.gaussian_count)
    for _ in range(draws.rng.choice((1, 1, 4))):
        steps[draws.rng.randrange(steps.size)] = draws.rng.choice(_STEPS)
    writer = PlaneWriter(ContextCounts())
    code_unsigned(writer, "keys", np.zeros_like(steps), KEY_CLASS_BITS, steps)
    axis_bits = draws.rng.choice((chunk.axis_bits, 20))
    return replace(chunk, axis_bits=axis_bits, sections=(writer.section(), *chunk.sections[1:]))


def state_random_codes(draws: Draws, counts: ContextCounts) -> StatingWriter:
    """State probabilities at random."""
    return _open_stating_writer(draws, counts, range(PROBABILITY_CODES))


def state_undefined_codes(draws: Draws, counts: ContextCounts) -> StatingWriter:
    """State probabilities at random, some by undefined codes."""
    return _open_stating_writer(draws, counts, range(draws.rng.choice((0, 200)), 256))


def _open_stating_writer(draws: Draws, counts: ContextCounts, codes: range) -> StatingWriter:
    return StatingWriter(counts, type(draws.rng)(draws.rng.getrandbits(64)), codes)


HOSTILE_VALUES: Sequence[Fault] = (
    Fault("codes out of range", Stage.SCENE, overflow_codes),
    Fault("rotations too long", Stage.SCENE, overflow_rotations),
    Fault(
        *("identity taken back", Stage.MOTION, degenerate_rotations),
        {"rotation_components": 4, "rotation_unity": 3},
    ),
    Fault("moved far", Stage.MOTION, move_far),
    Fault("moved out", Stage.MOTION, move_far, {"translation_step": (1 << 16) - 1}),
    Fault("turned much", Stage.MOTION, rotate_far, {"rotation_unity": 1}),
    Fault("all Gaussians leave by updates", Stage.UPDATES, delete_all, {"updates": True}),
    Fault("updated far", Stage.UPDATES, update_too_far, {"updates": True}),
    Fault(
        *("updated out", Stage.UPDATES, update_too_far),
        {"updates": True, "translation_step": (1 << 16) - 1},
    ),
    Fault("too large rotations by updates", Stage.UPDATES, rotate_too_far, {"updates": True}),
    Fault("parents elsewhere", Stage.BIRTHS, use_missing_parents),
    Fault("newborn far away", Stage.BIRTHS, place_births_far),
    Fault("newborn out", Stage.BIRTHS, place_births_far, {"position_step": (1 << 16) - 1}),
    Fault("codes of births out of range", Stage.BIRTHS, overflow_birth_codes),
    Fault("too long rotations of births", Stage.BIRTHS, overflow_birth_rotations),
    Fault("keys outside their box", Stage.CANONICAL, overflow_keys),
    Fault("random stated probabilities", Stage.WRITER, state_random_codes),
    Fault("undefined probabilities", Stage.WRITER, state_undefined_codes),
)
