"""Writes payloads of chunks as bytes, following the syntax tables of SPEC 5."""

import struct
import zlib
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass

MAGIC = bytes.fromhex("895152430D0A1A0A")
SYNC = bytes.fromhex("9E5143F3")


@dataclass(frozen=True, slots=True)
class Head:
    """The fields of HEAD in the order of SPEC 5.3."""

    version_major: int = 1
    version_minor: int = 0
    incompatible_features: int = 0
    compatible_features: int = 0
    level: int = 10
    timescale: int = 30
    frame_ticks: int = 1
    lattice_exponent: int = 12
    position_step: int = 4
    translation_step: int = 7
    rotation_unity: int = 100
    rotation_components: int = 3
    rotation_bits: int = 8
    log_scale_step: float = 1 / 16
    opacity_step: float = 1 / 8
    sh_dc_step: float = 1 / 32
    sh_rest_step: float = 1 / 32
    sh_degree: int = 1
    level_count: int = 3
    gaussians_per_anchor: int = 2
    anchor_ratio: int = 2
    resample_interval: int = 2
    full_crc_interval: int = 2
    seed: int = 0x0123456789ABCDEF
    right_handed: int = 1
    up_axis: int = 0
    meters_per_unit: float = 0.0
    color_space: int = 1

    @property
    def has_updates(self) -> bool:
        """Whether the stream may contain updates."""
        return bool(self.incompatible_features & 2)

    def pack(self) -> bytes:
        """Return the payload."""
        return struct.pack("<BBIIBIIBHHHBBffffBBHHHHQBBfB", *asdict(self).values())


def pack_section(words: Sequence[int]) -> bytes:
    """Return the bytes of a section (SPEC 8.1)."""
    return struct.pack(f"<I{len(words)}I", len(words), *words)


@dataclass(frozen=True, slots=True)
class Canonical:
    """The fields of CANO (SPEC 5.4); each section is a list of words."""

    frame: int
    gaussian_count: int
    origin: tuple[int, int, int]
    axis_bits: int
    sections: tuple[Sequence[int], ...]
    state_crc: int

    def pack(self) -> bytes:
        """Return the payload."""
        fields = struct.pack(
            "<II3iB", self.frame, self.gaussian_count, *self.origin, self.axis_bits
        )
        sections = b"".join(map(pack_section, self.sections))
        return fields + sections + struct.pack("<I", self.state_crc)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """The fields of SNAP (SPEC 5.10); each section is a list of words."""

    frame: int
    canonical: int
    newborn_count: int
    origin: tuple[int, int, int]
    axis_bits: int
    survivors: Sequence[int]
    sections: tuple[Sequence[int], ...]
    state_crc: int

    def pack(self) -> bytes:
        """Return the payload."""
        counts = (self.frame, self.canonical, self.newborn_count)
        fields = struct.pack("<III3iB", *counts, *self.origin, self.axis_bits)
        sections = b"".join(map(pack_section, (self.survivors, *self.sections)))
        return fields + sections + struct.pack("<I", self.state_crc)


@dataclass(frozen=True, slots=True)
class Frame:
    """The fields of FRAM (SPEC 5.5); each section is a list of words, or None if absent."""

    phase: int
    previous_contexts: int
    death_count: int
    birth_count: int
    motion: Sequence[int]
    births: Sequence[int]
    state_crc: int
    updates: Sequence[int] | None = None

    def pack(self) -> bytes:
        """Return the payload."""
        counts = (self.phase, self.previous_contexts, self.death_count, self.birth_count)
        updates = b"" if self.updates is None else pack_section(self.updates)
        sections = pack_section(self.motion) + updates + pack_section(self.births)
        return struct.pack("<IBII", *counts) + sections + struct.pack("<I", self.state_crc)


def pack_cameras(*cameras: bytes) -> bytes:
    """Return the payload of `came` (SPEC 5.6)."""
    return struct.pack("<H", len(cameras)) + b"".join(cameras)


def pack_camera(
    name: bytes = b"left", size: tuple[int, int] = (64, 48), near: float = 0.5
) -> bytes:
    """Return the bytes of a camera that is two units away from the origin."""
    numbers = (50.0, 50.0, 32.0, 24.0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 2, near)
    return bytes([len(name)]) + name + struct.pack("<BII17f", 1, *size, *numbers)


def pack_metadata(*entries: tuple[str, str]) -> bytes:
    """Return the payload of `meta` (SPEC 5.7)."""
    encoded = [(key.encode(), value.encode()) for key, value in entries]
    packed_entries = (bytes([len(k)]) + k + struct.pack("<I", len(v)) + v for k, v in encoded)
    return struct.pack("<H", len(entries)) + b"".join(packed_entries)


def pack_index(seek_points: Iterable[tuple[int, int, int]]) -> bytes:
    """Return the payload of INDX (SPEC 5.9); a point is (offset, sequence number, ordinal)."""
    packed = [struct.pack("<QII", *point) for point in seek_points]
    return struct.pack("<I", len(packed)) + b"".join(packed)


def pack_tail(frame_count: int, canonical_count: int, index_offset: int) -> bytes:
    """Return the payload of TAIL (SPEC 5.8)."""
    return struct.pack("<IIQ", frame_count, canonical_count, index_offset)


def pack_chunk_header(kind: bytes, sequence: int, length: int) -> bytes:
    """Return a chunk header with a correct CRC (SPEC 5.2)."""
    fields = SYNC + kind + struct.pack("<II", sequence, length)
    return fields + struct.pack("<I", zlib.crc32(fields))


def pack_chunk(kind: bytes, sequence: int, payload: bytes) -> bytes:
    """Return a chunk with correct CRCs (SPEC 5.2)."""
    header = pack_chunk_header(kind, sequence, len(payload))
    return header + payload + struct.pack("<I", zlib.crc32(payload))
