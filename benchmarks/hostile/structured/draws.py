"""Draws valid records: small scenes at any position, with any numbers that streams can have."""

import random
from dataclasses import dataclass, replace

import numpy as np

from quarc_ref.decoder.state import State
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import (
    CODE_LIMIT,
    POSITION_LIMIT,
    RESIDUAL_ROWS,
    SYMBOL_LIMIT,
)
from quarc_ref.format.records import LOG_SCALES, SH_DC, Births, Gaussians, StreamHeader
from quarc_ref.format.updates import UPDATE_FIELDS, Updates

_U16 = (1 << 16) - 1
_FIELDS: dict[str, tuple[int, ...]] = {
    "level": (10, 10, 10, 20, 30, 31),
    "lattice_exponent": (0, 12, 24),
    "position_step": (1, 4, 4, 4096, _U16),
    "translation_step": (1, 7, 7, 7, _U16),
    "rotation_unity": (1, 3, 100, 100, 256),
    "rotation_components": (3, 4),
    "rotation_bits": (1, 2, 8, 8, 14),
    "sh_degree": (0, 1, 1),
    "level_count": (1, 2, 3, 3),
    "gaussians_per_anchor": (1, 2, 4, _U16),
    "anchor_ratio": (2, 3, _U16),
    "resample_interval": (1, 2, 3, _U16),
    "full_crc_interval": (1, 2, _U16),
    "seed": (0, 7, (1 << 64) - 1),
    "updates": (False, True),
    "snapshots": (False, True),
}
_COUNTS = (1, 1, 2, 3, 5, 12, 12, 40, 40, 130)
_BOX = 1 << 20


@dataclass(slots=True)
class Draws:
    """Random values of one stream.

    Attributes:
        rng: Of single choices.
        numbers: Of arrays.
    """

    rng: random.Random
    numbers: np.random.Generator

    @classmethod
    def seeded(cls, *seed: int) -> "Draws":
        """Return the random values of a series and a number."""
        rng = random.Random(repr(seed))
        return cls(rng, np.random.default_rng(rng.getrandbits(64)))

    def header(self) -> StreamHeader:
        """Draw a header."""
        fields = {name: self.rng.choice(values) for name, values in _FIELDS.items()}
        return StreamHeader(**fields)  # type: ignore[arg-type]

    def gaussians(self, header: StreamHeader) -> Gaussians:
        """Draw Gaussians of a canonical frame."""
        count = self.rng.choice(_COUNTS)
        return Gaussians(
            self._positions(header, count),
            self._rotations(header, count),
            self._codes(header, count),
        )

    def symbols(self, started: State) -> list[Int64]:
        """Draw symbols of the anchors of a frame start."""
        most = self.rng.choice((0, 1, 3, 3, SYMBOL_LIMIT))
        share = self.rng.choice((0.1, 0.5, 1.0))
        levels = []
        for level in started.known_anchors.levels:
            shape = (started.scene.header.symbol_planes, level.owners.size)
            moving = self.numbers.random(shape[1]) < share
            levels.append(self.numbers.integers(-most, most + 1, shape) * moving)
            levels[-1][:3] = np.clip(levels[-1][:3], -3, 3)
        return levels

    def updates(self, moved: State) -> Updates:
        """Draw updates of a moved frame."""
        count = moved.scene.count
        chosen = np.flatnonzero(self.numbers.random(count) < self.rng.choice((0, 0.1, 0.5, 1)))
        dies = self.numbers.random(chosen.size) < self.rng.choice((0, 0, 0.3))
        if dies.sum() == count:
            dies[0] = False
        most = self.rng.choice((0, 1, 3, 40))
        residuals = self.numbers.integers(-most, most + 1, (RESIDUAL_ROWS, chosen.size)) * ~dies
        for rows in UPDATE_FIELDS.values():
            residuals[rows] *= self.rng.random() < 0.6
        return Updates(chosen, dies, residuals)

    def changed(self, header: StreamHeader, canonical: Gaussians) -> tuple[Gaussians, Int64]:
        """Draw a snapshot: changed Gaussians of a canonical frame, and others.

        Returns:
            The Gaussians, and `[N]` the index of each in the canonical frame, or -1 for new ones.
        """
        share = self.rng.choice((0, 0.5, 1, 1))
        left = np.flatnonzero(self.numbers.random(canonical.count) < share)
        most = self.rng.choice((0, 1, 3))
        kept = Gaussians(
            canonical.positions[:, left] + self._draw_small(most, 3, left.size),
            canonical.rotations[:, left],
            canonical.codes[:, left],
        )
        kept.codes[: SH_DC.stop] += self._draw_small(most, SH_DC.stop, left.size)
        if left.size and self.rng.random() < 0.5:
            return kept, left
        new = self.gaussians(header)
        near = canonical.positions[:, :1] - new.positions[:, :1]  # for a box that contains them all
        rows = [
            np.hstack(pair)
            for pair in (
                (kept.positions, new.positions + near),
                (kept.rotations, new.rotations),
                (kept.codes, new.codes),
            )
        ]
        return Gaussians(*rows), np.append(left, np.full(new.count, -1))

    def _draw_small(self, most: int, rows: int, columns: int) -> Int64:
        moves = self.numbers.random(columns) < 0.5
        return self.numbers.integers(-most, most + 1, (rows, columns)) * moves

    def births(self, moved: State) -> Births:
        """Draw births of a frame."""
        header, count = moved.scene.header, self.rng.choice((1, 2, 7, 30))
        parents = np.sort(self.numbers.integers(0, moved.scene.count, count))
        most = self.rng.choice((0, 1, 20))
        return Births(
            parents,
            Gaussians(
                self.numbers.integers(-most, most + 1, (3, count)),
                self._rotations(header, count),
                self._codes(header, count),
            ),
        )

    def _positions(self, header: StreamHeader, count: int) -> Int64:
        most = POSITION_LIMIT // header.position_step
        reach = min(self.rng.choice((0, 3, 400, _BOX // 2 - 1)), most)
        center = self.rng.choice((0, 0, 0, most - reach, reach - most))
        return center + self.numbers.integers(-reach, reach + 1, (3, count))

    def _rotations(self, header: StreamHeader, count: int) -> Int64:
        """Draw quaternion components: at most half of 1, or one of 1 and zeros."""
        one = 1 << header.rotation_bits
        components = self.numbers.integers(-(one // 2), one // 2 + 1, (3, count))
        if self.rng.random() < 0.2:
            alone = self.numbers.integers(0, 3, count)
            components[:] = 0
            components[alone, np.arange(count)] = self.numbers.choice([-one, one], count)
        return np.concatenate([self.numbers.integers(0, 4, (1, count)), components])

    def _codes(self, header: StreamHeader, count: int) -> Int64:
        """Draw codes that are in range, as are their coded differences."""
        most = self.rng.choice((0, 3, 60, 60, CODE_LIMIT))
        codes = self.numbers.integers(-most, most + 1, (header.code_planes, count))
        for first, other in ((SH_DC.start + 1, SH_DC.start), (SH_DC.start + 1, SH_DC.stop - 1)):
            codes[other] = _wrap_within(codes[other], codes[first])
        for row in range(LOG_SCALES.start + 1, LOG_SCALES.stop):
            codes[row] = _wrap_within(codes[row], codes[row - 1])
        return codes


def with_columns(gaussians: Gaussians, which: int, **columns: list[int]) -> Gaussians:
    """Return Gaussians, one of which has other numbers from the first row on.

    Args:
        gaussians: The Gaussians.
        which: Index of this Gaussian.
        columns: Its numbers by attribute.
    """
    changed = {}
    for name, numbers in columns.items():
        changed[name] = getattr(gaussians, name).copy()
        changed[name][: len(numbers), which] = numbers
    return replace(gaussians, **changed)


def _wrap_within(row: Int64, of: Int64) -> Int64:
    return np.clip(row, of - CODE_LIMIT, of + CODE_LIMIT)
