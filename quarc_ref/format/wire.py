"""The byte layout of every chunk: SPEC 5, one construct Struct a table.

The only importer of construct. Each layout serves both ways (`parse_x` beside
`build_x`); what construct or a record refuses becomes a `FieldError`, bytes
after the last field a `TrailingDataError`.
"""

import struct
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields
from typing import Any, TypeVar

import numpy as np
from construct import (
    Array,
    Bytes,
    Const,
    Construct,
    ConstructError,
    Float32l,
    Int8ul,
    Int16ul,
    Int32sl,
    Int32ul,
    Int64ul,
    OneOf,
    PascalString,
    PrefixedArray,
    Struct,
    Tell,
    this,
)

from quarc_ref.format import constants
from quarc_ref.format.errors import (
    EncodeError,
    FieldError,
    TrailingDataError,
    UnsupportedFeatureError,
    UnsupportedVersionError,
)
from quarc_ref.format.records import (
    Camera,
    CanonicalChunk,
    FrameChunk,
    Section,
    SeekPoint,
    StreamHeader,
    Tail,
)
from quarc_ref.format.seek_points import SeekPoints

# SPEC 5.2
CHUNK_HEADER = Struct(
    "sync" / Const(constants.SYNC),
    "type" / Bytes(4),
    "sequence" / Int32ul,
    "length" / Int32ul,
    "header_crc" / Int32ul,
)
_COMPILED_CHUNK_HEADER = CHUNK_HEADER.compile()  # junk may hold a header in every 20 bytes

# SPEC 5.3
VERSION = Struct(
    "version_major" / Int8ul,
    "version_minor" / Int8ul,
    "incompatible_features" / Int32ul,
    "compatible_features" / Int32ul,
)
STREAM_HEADER = Struct(
    "version" / VERSION,
    "level" / Int8ul,
    "timescale" / Int32ul,
    "frame_ticks" / Int32ul,
    "lattice_exponent" / Int8ul,
    "position_step" / Int16ul,
    "translation_step" / Int16ul,
    "rotation_unity" / Int16ul,
    "rotation_components" / Int8ul,
    "rotation_bits" / Int8ul,
    "log_scale_step" / Float32l,
    "opacity_step" / Float32l,
    "sh_dc_step" / Float32l,
    "sh_rest_step" / Float32l,
    "sh_degree" / Int8ul,
    "level_count" / Int8ul,
    "gaussians_per_anchor" / Int16ul,
    "anchor_ratio" / Int16ul,
    "resample_interval" / Int16ul,
    "full_crc_interval" / Int16ul,
    "seed" / Int64ul,
    "right_handed" / OneOf(Int8ul, (0, 1)),
    "up_axis" / Int8ul,
    "meters_per_unit" / Float32l,
    "color_space" / Int8ul,
)

# SPEC 5.4, 5.5, 8.1
SECTION = Struct(
    "word_count" / Int32ul,
    "words" / Bytes(this.word_count * (constants.WORD_BITS // 8)),
)
CANONICAL = Struct(
    "frame" / Int32ul,
    "gaussian_count" / Int32ul,
    "origin" / Array(3, Int32sl),
    "axis_bits" / Int8ul,
    "sections" / Array(constants.CANONICAL_SECTIONS, SECTION),
    "state_crc" / Int32ul,
)
FRAME = Struct(
    "phase" / Int32ul,
    "previous_contexts" / OneOf(Int8ul, (0, 1)),
    "death_count" / Int32ul,
    "birth_count" / Int32ul,
    "motion" / SECTION,
    "births" / SECTION,
    "state_crc" / Int32ul,
)
FRAME_WITH_UPDATES = Struct(*FRAME.subcons[:5], "updates" / SECTION, *FRAME.subcons[5:])
_FRAME_SECTIONS = ("motion", "updates", "births")

# SPEC 5.6
CAMERA = Struct(
    "name" / PascalString(Int8ul, "utf8"),
    "held_out" / OneOf(Int8ul, (0, 1)),
    "width" / Int32ul,
    "height" / Int32ul,
    "fx" / Float32l,
    "fy" / Float32l,
    "cx" / Float32l,
    "cy" / Float32l,
    "rotation" / Array(9, Float32l),
    "translation" / Array(3, Float32l),
    "near" / Float32l,
)
CAMERAS = Struct("cameras" / PrefixedArray(Int16ul, CAMERA))
_COMPILED_CAMERAS = Struct("body" / CAMERAS, "end" / Tell).compile()  # there may be 65535
_LEAST_CAMERA_BYTES = 1 + sum(field.sizeof() for field in CAMERA.subcons[1:])  # without a name

# SPEC 5.7
ENTRY = Struct("key" / PascalString(Int8ul, "utf8"), "value" / PascalString(Int32ul, "utf8"))
METADATA = Struct("entries" / PrefixedArray(Int16ul, ENTRY))

# SPEC 5.8
TAIL = Struct("frame_count" / Int32ul, "canonical_count" / Int32ul, "index_offset" / Int64ul)

# SPEC 5.9
SEEK_POINT = Struct("offset" / Int64ul, "sequence" / Int32ul, "frame" / Int32ul)
INDEX = Struct("count" / Int32ul, "points" / Bytes(this.count * SEEK_POINT.sizeof()))
_STORED_POINT = np.dtype([(field.name, f"<u{field.sizeof()}") for field in SEEK_POINT.subcons])


def parse_chunk_header(data: bytes) -> tuple[bytes, int, int, int]:
    """Return type, sequence number, length and CRC of 20 bytes that begin with the sync word."""
    parsed = _COMPILED_CHUNK_HEADER.parse(data)
    return parsed.type, parsed.sequence, parsed.length, parsed.header_crc


def build_chunk_header(kind: bytes, sequence: int, length: int, header_crc: int) -> bytes:
    """Return the 20 bytes ahead of a payload."""
    values = {"type": kind, "sequence": sequence, "length": length, "header_crc": header_crc}
    return _build(CHUNK_HEADER, values)


def parse_stream_header(payload: bytes) -> StreamHeader:
    """Parse HEAD (SPEC 5.3).

    Raises:
        UnsupportedVersionError: Another major version wrote the stream.
        UnsupportedFeatureError: The stream needs what this version lacks.
        FieldError: A field is out of range, or missing.
        TrailingDataError: Bytes follow the last field.
    """
    version = _parse(VERSION, payload[: VERSION.sizeof()])
    if version.version_major != constants.VERSION_MAJOR:
        message = (
            f"version {version.version_major}.{version.version_minor}; "
            f"this decoder reads {constants.VERSION_MAJOR}.x"
        )
        raise UnsupportedVersionError(message)
    if version.incompatible_features & ~constants.KNOWN_INCOMPATIBLE_FEATURES:
        message = f"incompatible features {version.incompatible_features:#x}"
        raise UnsupportedFeatureError(message)
    parsed = _parse(STREAM_HEADER, payload)
    parsed.updates = bool(version.incompatible_features & constants.FEATURE_UPDATES)
    return _record(StreamHeader, parsed)


def build_stream_header(header: StreamHeader) -> bytes:
    """Return the payload of HEAD."""
    minor, features = (1, constants.FEATURE_UPDATES) if header.updates else (0, 0)
    numbers = (constants.VERSION_MAJOR, minor, features, 0)
    version = {field.name: number for field, number in zip(VERSION.subcons, numbers, strict=True)}
    return _build(STREAM_HEADER, {"version": version, **asdict(header)})


def parse_canonical(payload: bytes) -> CanonicalChunk:
    """Parse CANO (SPEC 5.4)."""
    parsed = _parse(CANONICAL, payload)
    parsed.origin = tuple(parsed.origin)
    parsed.sections = tuple(_section(section) for section in parsed.sections)
    return _record(CanonicalChunk, parsed)


def build_canonical(chunk: CanonicalChunk) -> bytes:
    """Return the payload of CANO."""
    values = {field.name: getattr(chunk, field.name) for field in fields(chunk)}
    values["sections"] = [_section_values(section) for section in chunk.sections]
    return _build(CANONICAL, values)


def parse_frame(payload: bytes, *, updates: bool = False) -> FrameChunk:
    """Parse FRAM (SPEC 5.5) of a stream that has updates, or of one that has none."""
    parsed = _parse(FRAME_WITH_UPDATES if updates else FRAME, payload)
    parsed.previous_contexts = bool(parsed.previous_contexts)
    for name in _FRAME_SECTIONS:
        parsed[name] = _section(parsed[name]) if name in parsed else None
    return _record(FrameChunk, parsed)


def build_frame(chunk: FrameChunk) -> bytes:
    """Return the payload of FRAM."""
    values = {field.name: getattr(chunk, field.name) for field in fields(chunk)}
    values |= {name: values[name] and _section_values(values[name]) for name in _FRAME_SECTIONS}
    return _build(FRAME if chunk.updates is None else FRAME_WITH_UPDATES, values)


def parse_cameras(payload: bytes) -> tuple[Camera, ...]:
    """Parse `came` (SPEC 5.6)."""
    count, room = int.from_bytes(payload[:2], "little"), len(payload[2:])
    if count * _LEAST_CAMERA_BYTES > room:
        message = f"{count} cameras of at least {_LEAST_CAMERA_BYTES} bytes each in {room} bytes"
        raise FieldError(message)
    return tuple(_camera(parsed) for parsed in _parse(CAMERAS, payload, _COMPILED_CAMERAS).cameras)


def build_cameras(cameras: tuple[Camera, ...]) -> bytes:
    """Return the payload of `came`."""
    return _build(CAMERAS, {"cameras": [asdict(camera) for camera in cameras]})


def parse_metadata(payload: bytes) -> dict[str, str]:
    """Parse `meta` (SPEC 5.7)."""
    return {entry.key: entry.value for entry in _parse(METADATA, payload).entries}


def build_metadata(metadata: dict[str, str]) -> bytes:
    """Return the payload of `meta`."""
    entries = [{"key": key, "value": value} for key, value in metadata.items()]
    return _build(METADATA, {"entries": entries})


def parse_tail(payload: bytes) -> Tail:
    """Parse TAIL (SPEC 5.8)."""
    return _record(Tail, _parse(TAIL, payload))


def build_tail(tail: Tail) -> bytes:
    """Return the payload of TAIL."""
    return _build(TAIL, asdict(tail))


def parse_index(payload: bytes) -> SeekPoints:
    """Parse INDX (SPEC 5.9): its count is proved, and its entries stay as they are stored."""
    return SeekPoints(np.frombuffer(_parse(INDEX, payload).points, _STORED_POINT))


def build_index(points: Iterable[SeekPoint]) -> bytes:
    """Return the payload of INDX."""
    rows = SeekPoints.of(points).rows.astype(_STORED_POINT)
    return _build(INDEX, {"count": rows.size, "points": rows.tobytes()})


_Record = TypeVar("_Record")


def _parse(layout: Construct, payload: bytes, compiled: Construct | None = None) -> Any:  # noqa: ANN401, construct has no types
    whole = compiled or Struct("body" / layout, "end" / Tell)
    try:
        parsed = whole.parse(payload)
    except (ConstructError, ValueError, struct.error) as error:
        ends_early = isinstance(error, struct.error)  # where a layout is compiled
        message = "the payload ends too early" if ends_early else " ".join(str(error).split())
        raise FieldError(message) from error
    if parsed.end != len(payload):
        message = f"{len(payload) - parsed.end} bytes follow the last field"
        raise TrailingDataError(message)
    return parsed.body


def _build(layout: Construct, values: dict[str, Any]) -> bytes:
    try:
        built: bytes = layout.build(values)
    except (ConstructError, ValueError) as error:
        message = " ".join(str(error).split())
        raise EncodeError(message) from error
    return built


def _record(kind: Callable[..., _Record], parsed: Any) -> _Record:  # noqa: ANN401
    values = {name: parsed[name] for name in kind.__dataclass_fields__}  # type: ignore[attr-defined]
    try:
        return kind(**values)
    except ValueError as error:
        raise FieldError(str(error)) from error


def _camera(parsed: Any) -> Camera:  # noqa: ANN401
    rows = {name: tuple(parsed[name]) for name in ("rotation", "translation")}
    return _record(Camera, {**parsed, **rows, "held_out": bool(parsed["held_out"])})


def _section(parsed: Any) -> Section:  # noqa: ANN401
    return Section(np.frombuffer(parsed.words, dtype="<u4").astype(np.uint32))


def _section_values(section: Section) -> dict[str, Any]:
    words = section.words.astype("<u4").tobytes()
    return {"word_count": section.words.size, "words": words}
