"""Writes and reads `sequence.json`, which stores properties that frame files cannot store."""

import json
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from quarc_ref.export.clip import Clip
from quarc_ref.export.up_direction import UP_KEY, find_up_direction, format_up_direction
from quarc_ref.export.upright import UPRIGHT_AXIS, make_upright_matrix, rotate_camera_upright
from quarc_ref.format import wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import QuarcError
from quarc_ref.format.frame_rate import is_frame_rate
from quarc_ref.format.records import AXES, StreamHeader

SIDECAR_NAME = "sequence.json"
_PARSE_ERRORS = (
    QuarcError,
    ValueError,
    KeyError,
    TypeError,
    AttributeError,
    OverflowError,
    RecursionError,
)
_SCHEMA = "quarc-ref/sequence/1"
_KINDS = {
    bool: "true or false",
    int: "an integer",
    float: "a number",
    str: "a string",
    list: "a list",
    dict: "an object",
}
_MAX_CAMERAS = 1 << 12
_MAX_BYTES = 1 << 24
_MAX_FIRST_FRAME = 1 << 31  # leaves as many ordinals for later frames


def build_sidecar(clip: Clip, pattern: str, first_frame: int) -> bytes:
    """Build `sequence.json` with frame rate, axes, scale, cameras and metadata of a stream.

    Args:
        clip: Properties of the stream.
        pattern: Pattern of the file names; `{frame}` stands for the ordinal of the frame.
        first_frame: Ordinal of the first frame.
    """
    header = clip.header
    content: dict[str, Any] = {
        "schema": _SCHEMA,
        "files": pattern,
        "first_frame": first_frame,
        "frames_per_second": header.frames_per_second,
        "timescale": header.timescale,
        "frame_ticks": header.frame_ticks,
        "up": clip.up,
        "up_is_known": clip.has_up_axis,
        "right_handed": bool(header.right_handed),
        "meters_per_unit": header.meters_per_unit or None,
        "sh_degree": header.sh_degree,
        "cameras": [asdict(camera) for camera in clip.cameras],
        "metadata": clip.metadata,
    }
    return (json.dumps(content, indent=2) + "\n").encode()


@dataclass(frozen=True, slots=True)
class Sidecar:
    """Contents of `sequence.json`, with values encoded as in a stream's header.

    Attributes:
        frames_per_second: Frame rate; None if unknown.
        up_axis: Up axis, 1 to 6; 0 if unknown.
        right_handed: Whether the world frame is right-handed.
        meters_per_unit: Size of a world unit in meters; 0 if unknown.
        cameras: Cameras of the stream.
        metadata: Metadata of the stream.
        first_frame: Ordinal of the first frame.
        files: Name of the file of all frames, or pattern of the names; empty if unknown.
    """

    frames_per_second: float | None = None
    up_axis: int = 0
    right_handed: bool = True
    meters_per_unit: float = 0.0
    cameras: tuple[Camera, ...] = ()
    metadata: dict[str, str] = field(default_factory=dict)
    first_frame: int = 0
    files: str = ""


def rotate_sidecar_upright(sidecar: Sidecar) -> Sidecar:
    """Return the sidecar of the frames that `rotate_upright` returns for a stream.

    The up axis is +y, or unknown if the metadata state another up direction.

    Args:
        sidecar: Sidecar in the axes of the stream.
    """
    header = StreamHeader(right_handed=sidecar.right_handed, up_axis=sidecar.up_axis)
    clip, metadata = Clip(header), dict(sidecar.metadata)
    direction = None if sidecar.up_axis else find_up_direction(0, metadata)
    if direction is not None:
        metadata[UP_KEY] = format_up_direction(make_upright_matrix(clip) @ direction)
    return replace(
        sidecar,
        up_axis=UPRIGHT_AXIS if direction is None else 0,
        right_handed=True,
        cameras=tuple(rotate_camera_upright(camera, clip) for camera in sidecar.cameras),
        metadata=metadata,
    )


def parse_sidecar(data: bytes) -> Sidecar:
    """Parse a `sequence.json`.

    Raises:
        ValueError: The file is malformed.
    """
    if len(data) > _MAX_BYTES:
        message = f"the file has {len(data)} bytes; at most {_MAX_BYTES} are allowed"
        raise ValueError(message)
    try:
        content = json.loads(data)
        _require(isinstance(content, dict), "the content, which must be a JSON object,")
        _require(content["schema"] == _SCHEMA, "schema")
        frames_per_second = _read(content, "frames_per_second", float)
        _require(is_frame_rate(frames_per_second), "frames_per_second")
        first_frame = _read(content, "first_frame", int)
        _require(0 <= first_frame <= _MAX_FIRST_FRAME, "first_frame")
        metadata = _read(content, "metadata", dict)
        has_scale = content["meters_per_unit"] is not None
        sidecar = Sidecar(
            frames_per_second,
            1 + AXES.index(content["up"]) if _read(content, "up_is_known", bool) else 0,
            _read(content, "right_handed", bool),
            _read(content, "meters_per_unit", float) if has_scale else 0.0,
            _parse_cameras(_read(content, "cameras", list)),
            {key: _read(metadata, key, str) for key in metadata},
            first_frame,
            _read(content, "files", str),
        )
        _require_storable(sidecar)
    except _PARSE_ERRORS as error:
        problem = f"the key {error} is missing" if isinstance(error, KeyError) else error
        message = f"the file is not a valid {SIDECAR_NAME} of quarc-ref: {problem}"
        raise ValueError(message) from error
    return sidecar


def _require_storable(sidecar: Sidecar) -> None:
    """Raise ValueError or QuarcError if a stream cannot store the contents of a sidecar."""
    StreamHeader(meters_per_unit=sidecar.meters_per_unit)
    wire.parse_cameras(wire.build_cameras(sidecar.cameras))  # rounds to float32
    wire.build_metadata(sidecar.metadata)


def _parse_cameras(entries: list[Any]) -> tuple[Camera, ...]:
    _require(len(entries) <= _MAX_CAMERAS, "cameras")
    _require(all(isinstance(entry, dict) for entry in entries), "an item of cameras")
    return tuple(map(_parse_camera, entries))


def _parse_camera(content: dict[str, Any]) -> Camera:
    """Parse a camera; `parse_sidecar` converts the errors of malformed cameras."""
    width, height = (_read(content, name, int) for name in ("width", "height"))
    _require(0 < width < 1 << 32, "width")
    _require(0 < height < 1 << 32, "height")
    rotation, translation = (_read(content, name, list) for name in ("rotation", "translation"))
    fx, fy, cx, cy = (_read(content, name, float) for name in ("fx", "fy", "cx", "cy"))
    return Camera(
        _read(content, "name", str),
        width,
        height,
        fx,
        fy,
        cx,
        cy,
        tuple(_convert(number, "a number of rotation", float) for number in rotation),
        tuple(_convert(number, "a number of translation", float) for number in translation),
        _read(content, "near", float),
        _read(content, "held_out", bool),
    )


def _read(content: dict[str, Any], key: str, kind: type) -> Any:  # noqa: ANN401, any of _KINDS
    return _convert(content[key], key, kind)


def _convert(value: object, label: str, kind: type) -> Any:  # noqa: ANN401, any of _KINDS
    """Return a value of a JSON file; raise TypeError if it is not of a kind in `_KINDS`."""
    kinds = (int, float) if kind is float else (kind,)
    if not isinstance(value, kinds) or (isinstance(value, bool) and kind is not bool):
        message = f"{label} is not {_KINDS[kind]}"
        raise TypeError(message)
    return kind(value)


def _require(condition: bool, name: str) -> None:
    if not condition:
        message = f"{name} is invalid"
        raise ValueError(message)
