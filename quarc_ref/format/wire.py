"""Converts payloads of chunks to records and back, with the layouts of `layouts`: SPEC 5.

Each layout is used for parsing and for building. Parsing raises `FieldError` if construct or a
record rejects a value, and `TrailingDataError` if bytes follow the last field.
"""

import struct
from collections.abc import Callable, Iterable
from dataclasses import asdict, fields
from typing import Any, TypeVar

import numpy as np
from construct import Construct, ConstructError, StreamError, StringError, Struct, Tell

from quarc_ref.format import constants
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import (
    EncodeError,
    FieldError,
    TrailingDataError,
    UnsupportedFeatureError,
    UnsupportedVersionError,
)
from quarc_ref.format.layouts import (
    CAMERAS,
    CANONICAL,
    CHUNK_HEADER,
    COMPILED_CAMERAS,
    COMPILED_CHUNK_HEADER,
    FRAME,
    FRAME_WITH_UPDATES,
    INDEX,
    METADATA,
    MIN_CAMERA_BYTES,
    SEEK_POINT_DTYPE,
    SNAPSHOT,
    STREAM_HEADER,
    TAIL,
    VERSION,
)
from quarc_ref.format.records import (
    CanonicalChunk,
    FrameChunk,
    Section,
    SeekPoint,
    SnapshotChunk,
    StreamHeader,
    Tail,
)
from quarc_ref.format.seek_points import SeekPoints


def parse_chunk_header(data: bytes) -> tuple[bytes, int, int, int]:
    """Parse type, sequence number, length and CRC from the 20 bytes of a chunk header."""
    parsed = COMPILED_CHUNK_HEADER.parse(data)
    return parsed.type, parsed.sequence, parsed.length, parsed.header_crc


def build_chunk_header(kind: bytes, sequence: int, length: int, header_crc: int) -> bytes:
    """Build the 20 bytes of a chunk header."""
    values = {"type": kind, "sequence": sequence, "length": length, "header_crc": header_crc}
    return _build(CHUNK_HEADER, values)


def parse_stream_header(payload: bytes) -> StreamHeader:
    """Parse HEAD (SPEC 5.3).

    Raises:
        UnsupportedVersionError: The stream has a different major version.
        UnsupportedFeatureError: The stream uses a feature that this version does not support.
        FieldError: A field is out of range, or missing.
        TrailingDataError: Bytes follow the last field.
    """
    # [12-1] [5.3-1] Another major version may have other fields after these two.
    if len(payload) > 1 and payload[0] != constants.VERSION_MAJOR:
        message = (
            f"version {payload[0]}.{payload[1]}; this decoder reads {constants.VERSION_MAJOR}.x"
        )
        raise UnsupportedVersionError(message)
    version = _parse(VERSION, payload[: VERSION.sizeof()])
    if version.incompatible_features & ~constants.KNOWN_INCOMPATIBLE_FEATURES:  # [12-2] [12-3]
        message = f"incompatible features {version.incompatible_features:#x} are not supported"
        raise UnsupportedFeatureError(message)
    parsed = _parse(STREAM_HEADER, payload)
    for name, bit in _FEATURE_BITS.items():
        parsed[name] = bool(version.incompatible_features & bit)
    return _make_record(StreamHeader, parsed)


def build_stream_header(header: StreamHeader) -> bytes:
    """Return the payload of HEAD."""
    features = sum(bit for name, bit in _FEATURE_BITS.items() if getattr(header, name))
    version_values = (constants.VERSION_MAJOR, header.version_minor, features, 0)
    version = {
        field.name: number for field, number in zip(VERSION.subcons, version_values, strict=True)
    }
    return _build(STREAM_HEADER, {"version": version, **asdict(header)})


def parse_canonical(payload: bytes) -> CanonicalChunk:
    """Parse CANO (SPEC 5.4)."""
    parsed = _parse(CANONICAL, payload)
    parsed.origin = tuple(parsed.origin)
    parsed.sections = tuple(_make_section(section) for section in parsed.sections)
    return _make_record(CanonicalChunk, parsed)


def build_canonical(chunk: CanonicalChunk) -> bytes:
    """Return the payload of CANO."""
    values = {field.name: getattr(chunk, field.name) for field in fields(chunk)}
    values["sections"] = [_section_values(section) for section in chunk.sections]
    return _build(CANONICAL, values)


def parse_snapshot(payload: bytes) -> SnapshotChunk:
    """Parse SNAP (SPEC 5.10)."""
    parsed = _parse(SNAPSHOT, payload)
    parsed.origin = tuple(parsed.origin)
    parsed.survivors = _make_section(parsed.survivors)
    parsed.sections = tuple(_make_section(section) for section in parsed.sections)
    return _make_record(SnapshotChunk, parsed)


def build_snapshot(chunk: SnapshotChunk) -> bytes:
    """Return the payload of SNAP."""
    values = {field.name: getattr(chunk, field.name) for field in fields(chunk)}
    values["survivors"] = _section_values(chunk.survivors)
    values["sections"] = [_section_values(section) for section in chunk.sections]
    return _build(SNAPSHOT, values)


def parse_frame(payload: bytes, *, updates: bool = False) -> FrameChunk:
    """Parse FRAM (SPEC 5.5); `updates` states whether the stream has updates."""
    parsed = _parse(FRAME_WITH_UPDATES if updates else FRAME, payload)
    parsed.previous_contexts = bool(parsed.previous_contexts)
    for name in _FRAME_SECTIONS:
        parsed[name] = _make_section(parsed[name]) if name in parsed else None
    return _make_record(FrameChunk, parsed)


def build_frame(chunk: FrameChunk) -> bytes:
    """Return the payload of FRAM."""
    values = {field.name: getattr(chunk, field.name) for field in fields(chunk)}
    values |= {name: values[name] and _section_values(values[name]) for name in _FRAME_SECTIONS}
    return _build(FRAME if chunk.updates is None else FRAME_WITH_UPDATES, values)


def parse_cameras(payload: bytes) -> tuple[Camera, ...]:
    """Parse `came` (SPEC 5.6)."""
    count, available_bytes = int.from_bytes(payload[:2], "little"), len(payload[2:])
    if count * MIN_CAMERA_BYTES > available_bytes:
        message = (
            f"{count} cameras of at least {MIN_CAMERA_BYTES} bytes each do not fit into "
            f"{available_bytes} bytes"
        )
        raise FieldError(message)
    return tuple(
        _make_camera(parsed) for parsed in _parse(CAMERAS, payload, COMPILED_CAMERAS).cameras
    )


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
    return _make_record(Tail, _parse(TAIL, payload))


def build_tail(tail: Tail) -> bytes:
    """Return the payload of TAIL."""
    return _build(TAIL, asdict(tail))


def parse_index(payload: bytes) -> SeekPoints:
    """Parse INDX (SPEC 5.9) and check its number of entries, which stay in an array."""
    return SeekPoints(np.frombuffer(_parse(INDEX, payload).points, SEEK_POINT_DTYPE))


def build_index(points: Iterable[SeekPoint]) -> bytes:
    """Return the payload of INDX."""
    rows = SeekPoints.from_records(points).rows.astype(SEEK_POINT_DTYPE)
    return _build(INDEX, {"count": rows.size, "points": rows.tobytes()})


_Record = TypeVar("_Record")
_FRAME_SECTIONS = ("motion", "updates", "births")
_FEATURE_BITS = {"updates": constants.FEATURE_UPDATES, "snapshots": constants.FEATURE_SNAPSHOTS}


def _parse(layout: Construct, payload: bytes, compiled: Construct | None = None) -> Any:  # noqa: ANN401, construct has no types
    full_layout = compiled or Struct("body" / layout, "end" / Tell)
    try:
        parsed = full_layout.parse(payload)
    except (ConstructError, ValueError, struct.error) as error:  # [5-1] [5-4]
        raise FieldError(_describe_fault(error)) from error
    if parsed.end != len(payload):  # [5-2]
        message = f"{len(payload) - parsed.end} bytes follow the last field"
        raise TrailingDataError(message)
    return parsed.body


def _describe_fault(error: Exception) -> str:
    """Return a message that does not repeat the bytes of a field, which may be megabytes."""
    if isinstance(error, StringError | UnicodeDecodeError):
        return "a text is not valid UTF-8"
    path = str(getattr(error, "path", None)).split(" -> ")
    field = path[-1] if len(path) > 1 else "a field"  # compiled layouts give no path
    if isinstance(error, StreamError | struct.error):
        return f"the payload ends before the end of {field}"
    return f"{field} is out of its range"


def _build(layout: Construct, values: dict[str, Any]) -> bytes:
    try:
        payload: bytes = layout.build(values)
    except (ConstructError, ValueError) as error:
        message = " ".join(str(error).split())
        raise EncodeError(message) from error
    return payload


def _make_record(record_type: Callable[..., _Record], parsed: Any) -> _Record:  # noqa: ANN401
    values = {name: parsed[name] for name in record_type.__dataclass_fields__}  # type: ignore[attr-defined]
    try:
        return record_type(**values)  # [5-3]
    except ValueError as error:
        raise FieldError(str(error)) from error


def _make_camera(parsed: Any) -> Camera:  # noqa: ANN401
    tuples = {name: tuple(parsed[name]) for name in ("rotation", "translation")}
    return _make_record(Camera, {**parsed, **tuples, "held_out": bool(parsed["held_out"])})


def _make_section(parsed: Any) -> Section:  # noqa: ANN401
    return Section(np.frombuffer(parsed.words, dtype="<u4").astype(np.uint32))


def _section_values(section: Section) -> dict[str, Any]:
    words = section.words.astype("<u4").tobytes()
    return {"word_count": section.words.size, "words": words}
