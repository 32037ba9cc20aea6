"""Generates valid records: small scenes at random positions, with random values."""

import random
from dataclasses import dataclass, replace
from typing import Any

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

_MAX_U16 = (1 << 16) - 1
_HEADER_VALUES: dict[str, tuple[int, ...]] = {
    "level": (10, 10, 10, 20, 30, 31),
    "lattice_exponent": (0, 12, 24),
    "position_step": (1, 4, 4, 4096, _MAX_U16),
    "translation_step": (1, 7, 7, 7, _MAX_U16),
    "rotation_unity": (1, 3, 100, 100, 256),
    "rotation_components": (3, 4),
    "rotation_bits": (1, 2, 8, 8, 14),
    "sh_degree": (0, 1, 1),
    "level_count": (1, 2, 3, 3),
    "gaussians_per_anchor": (1, 2, 4, _MAX_U16),
    "anchor_ratio": (2, 3, _MAX_U16),
    "resample_interval": (1, 2, 3, _MAX_U16),
    "full_crc_interval": (1, 2, _MAX_U16),
    "seed": (0, 7, (1 << 64) - 1),
    "updates": (False, True),
    "snapshots": (False, True),
}
_GAUSSIAN_COUNTS = (1, 1, 2, 3, 5, 12, 12, 40, 40, 130)
_BOX_STEPS = 1 << 20


@dataclass(slots=True)
class RecordGenerator:
    """Generates the random values and records of one stream.

    Attributes:
        rng: Random generator for single values.
        array_rng: Random generator for arrays.
    """

    rng: random.Random
    array_rng: np.random.Generator

    @classmethod
    def from_seed(cls, *seed: int) -> "RecordGenerator":
        """Return a generator whose results depend only on the numbers of the seed."""
        rng = random.Random(repr(seed))
        return cls(rng, np.random.default_rng(rng.getrandbits(64)))

    def generate_header(self) -> StreamHeader:
        """Generate a header."""
        fields: dict[str, Any] = {
            name: self.rng.choice(values) for name, values in _HEADER_VALUES.items()
        }
        return StreamHeader(**fields)

    def generate_gaussians(self, header: StreamHeader) -> Gaussians:
        """Generate the Gaussians of a canonical frame."""
        count = self.rng.choice(_GAUSSIAN_COUNTS)
        return Gaussians(
            self._generate_positions(header, count),
            self._generate_rotations(header, count),
            self._generate_codes(header, count),
        )

    def generate_symbols(self, frame_start: State) -> list[Int64]:
        """Generate the anchors' symbols for a frame start, one array per level."""
        limit = self.rng.choice((0, 1, 3, 3, SYMBOL_LIMIT))
        share = self.rng.choice((0.1, 0.5, 1.0))
        levels = []
        for level in frame_start.required_anchors.levels:
            shape = (frame_start.scene.header.symbol_planes, level.owners.size)
            is_moving = self.array_rng.random(shape[1]) < share
            levels.append(self.array_rng.integers(-limit, limit + 1, shape) * is_moving)
            levels[-1][:3] = np.clip(levels[-1][:3], -3, 3)
        return levels

    def generate_updates(self, moved_frame: State) -> Updates:
        """Generate updates of a moved frame."""
        count = moved_frame.scene.count
        indices = np.flatnonzero(self.array_rng.random(count) < self.rng.choice((0, 0.1, 0.5, 1)))
        is_deleted = self.array_rng.random(indices.size) < self.rng.choice((0, 0, 0.3))
        if is_deleted.sum() == count:
            is_deleted[0] = False
        limit = self.rng.choice((0, 1, 3, 40))
        residuals = (
            self.array_rng.integers(-limit, limit + 1, (RESIDUAL_ROWS, indices.size)) * ~is_deleted
        )
        for rows in UPDATE_FIELDS.values():
            residuals[rows] *= self.rng.random() < 0.6
        return Updates(indices, is_deleted, residuals)

    def generate_snapshot(
        self, header: StreamHeader, canonical: Gaussians
    ) -> tuple[Gaussians, Int64]:
        """Generate a snapshot, which has changed Gaussians of a canonical frame and new Gaussians.

        Returns:
            The Gaussians, and the index `[N]` of each of them in the canonical frame; -1 for new
            Gaussians.
        """
        share = self.rng.choice((0, 0.5, 1, 1))
        survivors = np.flatnonzero(self.array_rng.random(canonical.count) < share)
        limit = self.rng.choice((0, 1, 3))
        changed_gaussians = Gaussians(
            canonical.positions[:, survivors]
            + self._generate_small_changes(limit, 3, survivors.size),
            canonical.rotations[:, survivors],
            canonical.codes[:, survivors],
        )
        changed_gaussians.codes[: SH_DC.stop] += self._generate_small_changes(
            limit, SH_DC.stop, survivors.size
        )
        if survivors.size and self.rng.random() < 0.5:
            return changed_gaussians, survivors
        newborn = self.generate_gaussians(header)
        offset = (
            canonical.positions[:, :1] - newborn.positions[:, :1]
        )  # keeps the box of all positions small
        rows = [
            np.hstack(pair)
            for pair in (
                (changed_gaussians.positions, newborn.positions + offset),
                (changed_gaussians.rotations, newborn.rotations),
                (changed_gaussians.codes, newborn.codes),
            )
        ]
        return Gaussians(*rows), np.append(survivors, np.full(newborn.count, -1))

    def _generate_small_changes(self, limit: int, rows: int, columns: int) -> Int64:
        is_changed = self.array_rng.random(columns) < 0.5
        return self.array_rng.integers(-limit, limit + 1, (rows, columns)) * is_changed

    def generate_births(self, moved_frame: State) -> Births:
        """Generate births of a frame."""
        header, count = moved_frame.scene.header, self.rng.choice((1, 2, 7, 30))
        parents = np.sort(self.array_rng.integers(0, moved_frame.scene.count, count))
        limit = self.rng.choice((0, 1, 20))
        return Births(
            parents,
            Gaussians(
                self.array_rng.integers(-limit, limit + 1, (3, count)),
                self._generate_rotations(header, count),
                self._generate_codes(header, count),
            ),
        )

    def _generate_positions(self, header: StreamHeader, count: int) -> Int64:
        limit = POSITION_LIMIT // header.position_step
        extent = min(self.rng.choice((0, 3, 400, _BOX_STEPS // 2 - 1)), limit)
        center = self.rng.choice((0, 0, 0, limit - extent, extent - limit))
        return center + self.array_rng.integers(-extent, extent + 1, (3, count))

    def _generate_rotations(self, header: StreamHeader, count: int) -> Int64:
        """Generate rotations with components up to magnitude 1/2, or with one that is 1 or -1."""
        unit = 1 << header.rotation_bits
        components = self.array_rng.integers(-(unit // 2), unit // 2 + 1, (3, count))
        if self.rng.random() < 0.2:
            axes = self.array_rng.integers(0, 3, count)
            components[:] = 0
            components[axes, np.arange(count)] = self.array_rng.choice([-unit, unit], count)
        return np.concatenate([self.array_rng.integers(0, 4, (1, count)), components])

    def _generate_codes(self, header: StreamHeader, count: int) -> Int64:
        """Generate codes such that the codes and their coded differences are in range."""
        limit = self.rng.choice((0, 3, 60, 60, CODE_LIMIT))
        codes = self.array_rng.integers(-limit, limit + 1, (header.code_planes, count))
        for reference_row, row_to_clamp in (
            (SH_DC.start + 1, SH_DC.start),
            (SH_DC.start + 1, SH_DC.stop - 1),
        ):
            codes[row_to_clamp] = _clamp_near(codes[row_to_clamp], codes[reference_row])
        for row in range(LOG_SCALES.start + 1, LOG_SCALES.stop):
            codes[row] = _clamp_near(codes[row], codes[row - 1])
        return codes


def replace_attributes(gaussians: Gaussians, index: int, **attributes: list[int]) -> Gaussians:
    """Return a copy of the Gaussians in which attributes of one Gaussian have new values.

    Args:
        gaussians: The Gaussians.
        index: Index of the Gaussian to change.
        attributes: New values by name of the attribute; they replace its first rows.
    """
    changed_attributes = {}
    for name, numbers in attributes.items():
        changed_attributes[name] = getattr(gaussians, name).copy()
        changed_attributes[name][: len(numbers), index] = numbers
    return replace(gaussians, **changed_attributes)


def _clamp_near(row: Int64, reference: Int64) -> Int64:
    return np.clip(row, reference - CODE_LIMIT, reference + CODE_LIMIT)
