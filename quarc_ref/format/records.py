"""Records that hold the checked contents of chunks: SPEC 5.

Each frozen record checks its fields when it is created, so that other code can rely on
them. A field out of range raises ValueError, which `wire` converts to `FieldError` when
it parses a stream.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.format import constants
from quarc_ref.format.arrays import Int64, UInt32
from quarc_ref.format.constants import LEVELS, Level
from quarc_ref.format.described import described


@dataclass(frozen=True, slots=True)
class Section:
    """The coded words of a group of planes, such as the positions of a frame (SPEC 8.1).

    Attributes:
        words: `[n]` words of the entropy coder, uint32.
    """

    words: UInt32

    def byte_count(self) -> int:
        """Return the size of the section in a stream, including its length field."""
        return constants.SECTION_HEADER_BYTES + self.words.nbytes


@dataclass(frozen=True, slots=True)
class StreamHeader:
    """Parameters of a stream: the HEAD chunk (SPEC 5.3)."""

    level: int = described(10, "Conformance level, one of `constants.LEVELS`.")
    timescale: int = described(30, "Clock ticks per second.")
    frame_ticks: int = described(1, "Clock ticks per frame.")
    lattice_exponent: int = described(12, "A lattice unit is 2^-lattice_exponent world units.")
    position_step: int = described(
        4, "Step of the coded positions of canonical and new Gaussians, lattice units."
    )
    translation_step: int = described(7, "Step of translation residuals, lattice units.")
    rotation_unity: int = described(100, "w component of the identity residual, in rotation steps.")
    rotation_components: int = described(
        3, "Number of components of a rotation residual: 3 (xyz) or 4 (wxyz)."
    )
    rotation_bits: int = described(
        8, "Fraction bits of the coded rotations of canonical and new Gaussians."
    )
    log_scale_step: float = described(
        1 / 16, "Step of log-scale codes, in units of the natural logarithm."
    )
    opacity_step: float = described(1 / 8, "Step of opacity logit codes.")
    sh_dc_step: float = described(1 / 32, "Step of SH degree 0 codes.")
    sh_rest_step: float = described(1 / 32, "Step of SH degree 1 codes.")
    sh_degree: int = described(1, "Degree of spherical harmonics: 0 or 1.")
    level_count: int = described(3, "Number of anchor levels, 1 to 3.")
    gaussians_per_anchor: int = described(
        4, "Number of Gaussians per anchor of level 1, the finest level."
    )
    anchor_ratio: int = described(
        3, "Number of anchors of a level per anchor of the next coarser level."
    )
    resample_interval: int = described(
        2, "Number of frames from one sampling of anchors to the next."
    )
    full_crc_interval: int = described(
        32, "Number of frames from one state CRC over all fields to the next."
    )
    seed: int = described(0, "Seed of the anchor sampler, 64 bits.")
    right_handed: bool = described(True, "Whether the world coordinate system is right-handed.")
    up_axis: int = described(0, "Up direction: 1 to 6 for +x, -x, +y, -y, +z, -z; 0 if unknown.")
    meters_per_unit: float = described(0.0, "Size of a world unit in meters; 0 if unknown.")
    color_space: int = described(1, "Color space; 1 is sRGB, blended without linearization.")
    updates: bool = described(
        False, "Whether frames may update individual Gaussians, a feature of version 1.1 (SPEC 12)."
    )
    snapshots: bool = described(
        False, "Whether the stream may contain snapshots, a feature of version 1.1 (SPEC 12)."
    )

    def __post_init__(self) -> None:
        if self.level not in LEVELS:
            message = f"level {self.level} is not one of {sorted(LEVELS)}"
            raise ValueError(message)
        for name, (minimum, maximum) in _HEADER_RANGES.items():
            value = getattr(self, name)
            if not minimum <= value <= maximum:
                message = f"{name} is {value}, but must be from {minimum} to {maximum}"
                raise ValueError(message)
        for name in _HEADER_STEPS:
            value = getattr(self, name)
            if (
                not 0 < value <= constants.STEP_LIMIT
                or float(np.array(value, dtype="<f4")) != value
            ):
                message = f"{name} is {value}, not a binary32 in (0, {constants.STEP_LIMIT}]"
                raise ValueError(message)

    @property
    def limits(self) -> Level:
        """Limits of the stream's level."""
        return LEVELS[self.level]

    @property
    def code_planes(self) -> int:
        """Number of attribute codes of a Gaussian: 7 at SH degree 0, 16 at degree 1."""
        base_planes = constants.LOG_SCALE_PLANES + constants.OPACITY_PLANES + constants.SH_DC_PLANES
        return base_planes + (constants.SH_REST_PLANES if self.sh_degree else 0)

    @property
    def symbol_planes(self) -> int:
        """Number of symbols of an anchor: three for translation and three or four for rotation."""
        return 3 + self.rotation_components

    @property
    def version_minor(self) -> int:
        """Lowest minor version that has the features of the stream (SPEC 12)."""
        return int(self.updates or self.snapshots)

    @property
    def frames_per_second(self) -> float:
        """Frame rate of the stream."""
        return self.timescale / self.frame_ticks

    @property
    def up(self) -> str | None:
        """Up axis, such as `-y`; None if it is unknown."""
        return AXES[self.up_axis - 1] if self.up_axis else None


AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
_UINT16_MAX = (1 << 16) - 1
_UINT32_MAX = (1 << 32) - 1
LATTICE_STEP_LIMIT = _UINT16_MAX  # largest step of positions and translations, lattice units
_HEADER_RANGES = {
    "timescale": (1, _UINT32_MAX),
    "frame_ticks": (1, _UINT32_MAX),
    "lattice_exponent": (0, constants.LATTICE_EXPONENT_LIMIT),
    "position_step": (1, LATTICE_STEP_LIMIT),
    "translation_step": (1, LATTICE_STEP_LIMIT),
    "rotation_unity": (1, constants.ROTATION_UNITY_LIMIT),
    "rotation_components": (3, 4),
    "rotation_bits": (1, constants.ROTATION_BITS_LIMIT),
    "sh_degree": (0, 1),
    "level_count": (1, constants.LEVEL_COUNT_LIMIT),
    "gaussians_per_anchor": (1, _UINT16_MAX),
    "anchor_ratio": (2, _UINT16_MAX),
    "resample_interval": (1, _UINT16_MAX),
    "full_crc_interval": (1, _UINT16_MAX),
    "seed": (0, (1 << 64) - 1),
    "up_axis": (0, 6),
    "meters_per_unit": (0.0, 1e6),
    "color_space": (1, 1),
}
_HEADER_STEPS = ("log_scale_step", "opacity_step", "sh_dc_step", "sh_rest_step")


LOG_SCALES = slice(0, constants.LOG_SCALE_PLANES)
OPACITY = slice(LOG_SCALES.stop, LOG_SCALES.stop + constants.OPACITY_PLANES)
SH_DC = slice(OPACITY.stop, OPACITY.stop + constants.SH_DC_PLANES)
SH_REST = slice(SH_DC.stop, SH_DC.stop + constants.SH_REST_PLANES)


@dataclass(frozen=True, slots=True)
class Gaussians:
    """Gaussians as coded integers, in quantization steps (SPEC 5.4).

    Attributes:
        positions: `[3, n]` positions xyz, in position steps.
        rotations: `[4, n]` index of the largest component, which is positive, then the
            other three components in order, in units of 2^-rotation_bits.
        codes: `[code_planes, n]` codes of log-scale (3), opacity (1), SH DC (3), SH rest (9).
    """

    positions: Int64
    rotations: Int64
    codes: Int64

    @property
    def count(self) -> int:
        """Number of Gaussians, n."""
        return int(self.positions.shape[1])


@dataclass(frozen=True, slots=True)
class Births:
    """The new Gaussians of a frame (SPEC 7.6).

    Attributes:
        parents: `[n]` index in the scene of each new Gaussian's parent, ascending.
        newborn: New Gaussians. Positions are relative to the parent; rotations and codes
            are absolute.
    """

    parents: Int64
    newborn: Gaussians


@dataclass(frozen=True, slots=True)
class CanonicalChunk:
    """A coded canonical frame: the CANO chunk (SPEC 5.4).

    Attributes:
        frame: Ordinal of the frame in the stream.
        gaussian_count: Number of Gaussians in the frame.
        origin: Minimum xyz of the positions, in position steps.
        axis_bits: Bits per axis of a position relative to the origin.
        sections: Sections of positions, SH DC, opacity, log-scales, rotations and SH rest.
        state_crc: CRC-32 of the decoded state.
    """

    frame: int
    gaussian_count: int
    origin: tuple[int, int, int]
    axis_bits: int
    sections: tuple[Section, ...]
    state_crc: int

    def __post_init__(self) -> None:
        _check_axis_bits(self.axis_bits)


@dataclass(frozen=True, slots=True)
class SnapshotChunk:
    """A canonical frame coded relative to the last CANO: the SNAP chunk (SPEC 5.10).

    Attributes:
        frame: Ordinal of the frame in the stream.
        canonical: Ordinal of the frame that the CANO contains.
        newborn_count: Number of Gaussians that are not in the CANO.
        origin: Minimum xyz of the new Gaussians' positions, in position steps.
        axis_bits: Bits per axis of a position relative to the origin.
        survivors: Section of the surviving Gaussians of the CANO and their differences.
        sections: Sections of the new Gaussians, as in a CANO.
        state_crc: CRC-32 of the decoded state.
    """

    frame: int
    canonical: int
    newborn_count: int
    origin: tuple[int, int, int]
    axis_bits: int
    survivors: Section
    sections: tuple[Section, ...]
    state_crc: int

    def __post_init__(self) -> None:
        _check_axis_bits(self.axis_bits)


def _check_axis_bits(axis_bits: int) -> None:
    if axis_bits > constants.AXIS_BITS_LIMIT:
        message = f"axis_bits is {axis_bits}, above the limit of {constants.AXIS_BITS_LIMIT}"
        raise ValueError(message)


@dataclass(frozen=True, slots=True)
class FrameChunk:
    """A frame coded relative to the previous frame: the FRAM chunk (SPEC 5.5).

    Attributes:
        phase: Number of frames since the canonical frame.
        previous_contexts: Whether contexts depend on the previous frame's motion.
        death_count: Number of Gaussians deleted before the motion.
        birth_count: Number of Gaussians added after the motion.
        motion: Section of the anchors' symbols.
        births: Section of the new Gaussians; empty if there are none.
        state_crc: CRC-32 of the decoded state.
        updates: Section of updates of individual Gaussians; None in a stream without updates.
    """

    phase: int
    previous_contexts: bool
    death_count: int
    birth_count: int
    motion: Section
    births: Section
    state_crc: int
    updates: Section | None = None


@dataclass(frozen=True, slots=True)
class Tail:
    """The TAIL chunk: numbers of frames and seek points, and the offset of INDX (SPEC 5.8)."""

    frame_count: int
    canonical_count: int
    index_offset: int

    def __str__(self) -> str:
        index = f"INDX at byte {self.index_offset}" if self.index_offset else "no INDX"
        return f"frames: {self.frame_count}, canonical: {self.canonical_count}, {index}"


@dataclass(frozen=True, slots=True)
class SeekPoint:
    """An entry of the INDX chunk: where a canonical frame begins (SPEC 5.9).

    Attributes:
        offset: Offset of the chunk in the stream.
        sequence: Sequence number of the chunk.
        frame: Ordinal of the frame.
    """

    offset: int
    sequence: int
    frame: int

    def __str__(self) -> str:
        return f"frame {self.frame} in chunk {self.sequence} at byte {self.offset}"
