"""The state of SPEC 7.1 in plain Python integers."""

import hashlib
import struct
from dataclasses import dataclass, field

from plain.coder import Counts

Vector = list[int]


@dataclass
class PlainLevel:
    owners: list[int]
    positions: list[Vector]
    parents: list[int]
    binding: dict[int, int]
    expected: list[Vector] = field(default_factory=list)
    symbols: list[Vector] = field(default_factory=list)


@dataclass
class PlainGaussian:
    id: int
    position: Vector
    rotation: Vector
    codes: Vector
    motion: Vector
    recency: int = 3


@dataclass
class PlainCodedGaussian:
    """A coded Gaussian of a canonical frame: position in steps, rotation as (j, a, b, c)."""

    position: Vector
    rotation: Vector
    codes: Vector


@dataclass
class PlainState:
    frame: int
    phase: int
    next_id: int
    gaussians: list[PlainGaussian]
    levels: list[PlainLevel]
    counts: Counts = field(default_factory=dict)
    canonical: tuple[int, list[PlainCodedGaussian]] | None = (
        None  # ordinal and Gaussians of the last CANO
    )

    def serialize(self, *, codes: bool = True) -> bytes:
        """Return the state as bytes (SPEC 9.1), optionally without codes."""
        numbers = [len(self.gaussians), self.phase, *(g.id for g in self.gaussians)]
        columns = [g.position + g.rotation + (g.codes if codes else []) for g in self.gaussians]
        planes = [value for plane in zip(*columns, strict=True) for value in plane]
        return struct.pack(f"<{len(numbers)}I{len(planes)}i", *numbers, *planes)

    def compute_digest(self) -> str:
        return hashlib.sha256(self.serialize()).hexdigest()
