"""Hostile values: each can be coded, but no encoder writes them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hostile.structured.draws import Draws, with_columns
from hostile.structured.hostility import Hostility, Stage
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

# Steps of ascending numbers: out of range, or with a sum that overflows.
_STEPS = (1, 1 << 31, 1 << 32, 1 << 59, 1 << 60, (1 << 60) + 1, 1 << 62, (1 << 63) - 1)


def overflow_codes(draws: Draws, gaussians: Gaussians, _header: StreamHeader) -> Gaussians:
    """Give a Gaussian a color out of range whose coded differences are in range."""
    sign = draws.rng.choice((-1, 1))
    most, more = sign * CODE_LIMIT, sign * draws.rng.choice((1, 2, CODE_LIMIT))
    codes = gaussians.codes.copy()
    which = draws.rng.randrange(gaussians.count)
    codes[SH_DC, which] = draws.rng.choice(
        ([most + more, most, most], [most, most, most + more], [most + more, most, most - most])
    )
    return replace(gaussians, codes=codes)


def overflow_rotations(draws: Draws, gaussians: Gaussians, header: StreamHeader) -> Gaussians:
    """Give a Gaussian three components that are longer than a unit quaternion."""
    one = 1 << header.rotation_bits
    index, which = draws.rng.randrange(4), draws.rng.randrange(gaussians.count)
    components = draws.rng.choice(
        ([one, 1, 0], [one + 1, 0, 0], [one, one, -one], [-CODE_LIMIT] * 3, [0, 0, CODE_LIMIT])
    )
    return with_columns(gaussians, which, rotations=[index, *components])


def degenerate_rotations(draws: Draws, symbols: list[Int64], started: State) -> list[Int64]:
    """Make residuals of w cancel the identity: of all Gaussians, or of one anchor."""
    identity = started.scene.header.rotation_unity * started.scene.header.level_count
    still = [np.zeros_like(level) for level in symbols]
    if draws.rng.random() < 0.5:
        still[-1][3] = -identity
    else:
        still[0][3, draws.rng.randrange(still[0].shape[1])] = -identity
    return still


def move_far(draws: Draws, symbols: list[Int64], _begun: State) -> list[Int64]:
    """Move everything along an axis as far as symbols allow, in every level."""
    axis, sign = draws.rng.randrange(3), draws.rng.choice((-1, 1))
    for level in symbols:
        level[axis] = sign * SYMBOL_LIMIT
    return symbols


def rotate_far(draws: Draws, symbols: list[Int64], _begun: State) -> list[Int64]:
    """Rotate everything by residuals of any size."""
    for level in symbols:
        level[3:] = draws.numbers.integers(-SYMBOL_LIMIT, SYMBOL_LIMIT + 1, level[3:].shape)
    return symbols


def delete_all(_draws: Draws, _updates: Updates, moved: State) -> Updates:
    """Delete all Gaussians by updates."""
    count = moved.scene.count
    nothing = np.zeros((RESIDUAL_ROWS, count), dtype=np.int64)
    return Updates(np.arange(count), np.ones(count, dtype=np.bool_), nothing)


def update_too_far(draws: Draws, _updates: Updates, moved: State) -> Updates:
    """Move a Gaussian, or change its codes, as far as residuals allow."""
    updates = _update_one(draws, moved)
    rows = draws.rng.choice((TRANSLATION, CODES))
    updates.residuals[rows] = draws.rng.choice((-CODE_LIMIT, CODE_LIMIT))
    return updates


def rotate_too_far(draws: Draws, _updates: Updates, moved: State) -> Updates:
    """Rotate a Gaussian by a residual that is too large, or by the largest."""
    updates = _update_one(draws, moved)
    most = ROTATION_UNITY_LIMIT
    turn = draws.rng.choice((most, most + 1, -most - 1, CODE_LIMIT))
    updates.residuals[ROTATION.start + draws.rng.randrange(3)] = turn
    return updates


def _update_one(draws: Draws, moved: State) -> Updates:
    which = np.array([draws.rng.randrange(moved.scene.count)])
    return Updates(which, np.zeros(1, np.bool_), np.zeros((RESIDUAL_ROWS, 1), dtype=np.int64))


def use_missing_parents(draws: Draws, births: Births, moved: State) -> Births:
    """Use parents outside the scene: just beyond it, far beyond, or beyond 64 bits."""
    count = moved.scene.count
    steps = np.zeros_like(births.parents)
    steps[draws.rng.randrange(steps.size)] = draws.rng.choice((count, count + 1, *_STEPS[1:]))
    if draws.rng.random() < 0.2:
        steps[:] = draws.rng.choice(_STEPS)
    return replace(births, parents=np.cumsum(steps))


def place_births_far(draws: Draws, births: Births, _moved: State) -> Births:
    """Place births as far from their parents as their codes allow."""
    positions = draws.numbers.choice([-CODE_LIMIT, CODE_LIMIT], births.newborn.positions.shape)
    return replace(births, newborn=replace(births.newborn, positions=positions))


def overflow_birth_codes(draws: Draws, births: Births, moved: State) -> Births:
    """Add births whose codes go out of range by their differences."""
    if draws.rng.random() < 0.5:
        return replace(births, newborn=overflow_codes(draws, births.newborn, moved.scene.header))
    codes = births.newborn.codes.copy()
    which = draws.rng.randrange(births.newborn.count)
    codes[LOG_SCALES, which] = [CODE_LIMIT, CODE_LIMIT + 1, 2 * CODE_LIMIT + 1]
    return replace(births, newborn=replace(births.newborn, codes=codes))


def overflow_birth_rotations(draws: Draws, births: Births, moved: State) -> Births:
    """Add a newborn whose rotation is too long."""
    newborn = overflow_rotations(draws, births.newborn, moved.scene.header)
    return replace(births, newborn=newborn)


def overflow_keys(draws: Draws, chunk: CanonicalChunk) -> CanonicalChunk:
    """Code keys outside the box: too large, or with a sum beyond 64 bits."""
    steps = draws.numbers.choice([0, 0, 1], chunk.gaussian_count)
    for _ in range(draws.rng.choice((1, 1, 4))):
        steps[draws.rng.randrange(steps.size)] = draws.rng.choice(_STEPS)
    writer = PlaneWriter(ContextCounts())
    code_unsigned(writer, "keys", np.zeros_like(steps), KEY_CLASS_BITS, steps)
    box = draws.rng.choice((chunk.axis_bits, 20))
    return replace(chunk, axis_bits=box, sections=(writer.section(), *chunk.sections[1:]))


def state_random_codes(draws: Draws, counts: ContextCounts) -> StatingWriter:
    """State probabilities at random."""
    return _open_stating_writer(draws, counts, range(PROBABILITY_CODES))


def state_undefined_codes(draws: Draws, counts: ContextCounts) -> StatingWriter:
    """State probabilities at random, occasionally an undefined one."""
    return _open_stating_writer(draws, counts, range(draws.rng.choice((0, 200)), 256))


def _open_stating_writer(draws: Draws, counts: ContextCounts, codes: range) -> StatingWriter:
    return StatingWriter(counts, type(draws.rng)(draws.rng.getrandbits(64)), codes)


HOSTILE_VALUES: Sequence[Hostility] = (
    Hostility("codes out of range", Stage.SCENE, overflow_codes),
    Hostility("rotations too long", Stage.SCENE, overflow_rotations),
    Hostility(
        *("identity taken back", Stage.MOTION, degenerate_rotations),
        {"rotation_components": 4, "rotation_unity": 3},
    ),
    Hostility("moved far", Stage.MOTION, move_far),
    Hostility("moved out", Stage.MOTION, move_far, {"translation_step": (1 << 16) - 1}),
    Hostility("turned much", Stage.MOTION, rotate_far, {"rotation_unity": 1}),
    Hostility("all Gaussians leave by updates", Stage.UPDATES, delete_all, {"updates": True}),
    Hostility("updated far", Stage.UPDATES, update_too_far, {"updates": True}),
    Hostility(
        *("updated out", Stage.UPDATES, update_too_far),
        {"updates": True, "translation_step": (1 << 16) - 1},
    ),
    Hostility("too large rotations by updates", Stage.UPDATES, rotate_too_far, {"updates": True}),
    Hostility("parents elsewhere", Stage.BIRTHS, use_missing_parents),
    Hostility("newborn far away", Stage.BIRTHS, place_births_far),
    Hostility("newborn out", Stage.BIRTHS, place_births_far, {"position_step": (1 << 16) - 1}),
    Hostility("codes of births out of range", Stage.BIRTHS, overflow_birth_codes),
    Hostility("too long rotations of births", Stage.BIRTHS, overflow_birth_rotations),
    Hostility("keys outside their box", Stage.CANONICAL, overflow_keys),
    Hostility("random stated probabilities", Stage.WRITER, state_random_codes),
    Hostility("undefined probabilities", Stage.WRITER, state_undefined_codes),
)
