"""Reads and writes `quarc-capture.json` (`capture_notes`)."""

import json
from collections import Counter
from pathlib import Path

from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes, Direction
from quarc_ref.datasets.errors import MissingFileError, UnreadableNotesError
from quarc_ref.datasets.ignored_frames import parse_ignored_frames
from quarc_ref.files import write_file

_KEYS = ("offsets", "frames_per_second", "up", "meters_per_unit", "background", "ignored_frames")
_BACKGROUNDS = {"opaque": False, "transparent": True}
_MAX_BYTES = 1 << 20


def read_capture_notes(folder: Path) -> CaptureNotes:
    """Read `quarc-capture.json` in the folder of a capture; return empty notes if it is missing.

    Args:
        folder: Folder of the capture.

    Raises:
        MissingFileError: The file exists but cannot be read.
        UnreadableNotesError: The file is malformed.
    """
    path = folder / NOTES_NAME
    if not path.is_file():
        return CaptureNotes()
    try:
        with path.open("rb") as file:
            data = file.read(_MAX_BYTES + 1)
        return _parse_notes(data)
    except OSError as error:
        raise MissingFileError.of(path, error) from error
    except (OverflowError, RecursionError, TypeError, ValueError) as error:
        message = f"{path}: {error}"
        raise UnreadableNotesError(message) from error


def write_capture_notes(path: Path, notes: CaptureNotes) -> None:
    """Write notes to a file, replacing an existing file.

    Args:
        path: Path of the file; the file name must be `NOTES_NAME`.
        notes: Notes to write; unknown values are omitted.

    Raises:
        OSError: The file cannot be written.
    """
    document: dict[str, object] = {"offsets": dict(notes.offsets)}
    if notes.up is not None:
        document["up"] = list(notes.up)
    if notes.meters_per_unit is not None:
        document["meters_per_unit"] = notes.meters_per_unit
    if notes.frames_per_second is not None:
        document["frames_per_second"] = notes.frames_per_second
    if notes.has_transparent_background:
        document["background"] = "transparent"
    if notes.ignored_frames.spans:
        document["ignored_frames"] = notes.ignored_frames.to_json()
    write_file(path, _to_bytes(document))


def without_ignored_frames(data: bytes) -> bytes:
    """Return the contents of valid notes without `ignored_frames`, formatted like written notes.

    White space does not count, because adding the key by hand usually changes it elsewhere.
    """
    document = json.loads(data)
    document.pop("ignored_frames", None)
    return _to_bytes(document)


def _to_bytes(document: dict[str, object]) -> bytes:
    return json.dumps(document, indent=2, allow_nan=False).encode() + b"\n"


def _parse_notes(data: bytes) -> CaptureNotes:
    if len(data) > _MAX_BYTES:
        message = f"the file has more than {_MAX_BYTES:,} bytes"
        raise ValueError(message)
    document = json.loads(data, object_pairs_hook=_make_object)
    if not isinstance(document, dict):
        message = "the file is not a JSON object"
        raise TypeError(message)
    unknown_keys = sorted(set(document) - set(_KEYS))
    if unknown_keys:
        message = (
            f"unknown keys: {', '.join(map(repr, unknown_keys))}; the known keys are "
            f"{', '.join(_KEYS)}"
        )
        raise ValueError(message)
    offsets = document.get("offsets", {})
    if not isinstance(offsets, dict):
        message = "'offsets' is not an object that maps cameras to frames"
        raise TypeError(message)
    meters_per_unit, frames_per_second = (
        _parse_number(document[key], key) if key in document else None
        for key in ("meters_per_unit", "frames_per_second")
    )
    return CaptureNotes(
        {name: _parse_number(offset, f"the offset of {name}") for name, offset in offsets.items()},
        _parse_up(document["up"]) if "up" in document else None,
        meters_per_unit,
        frames_per_second,
        _parse_background(document.get("background", "opaque")),
        parse_ignored_frames(document.get("ignored_frames", {})),
    )


def _make_object(pairs: list[tuple[str, object]]) -> dict[str, object]:
    """Return a JSON object; raise ValueError if keys repeat, because only one would count."""
    repeated = sorted(key for key, count in Counter(key for key, _ in pairs).items() if count > 1)
    if repeated:
        message = f"{', '.join(map(repr, repeated))} is given twice: join the values"
        raise ValueError(message)
    return dict(pairs)


def _parse_background(value: object) -> bool:
    if not isinstance(value, str) or value not in _BACKGROUNDS:
        message = f"'background' is not one of {', '.join(map(repr, _BACKGROUNDS))}"
        raise ValueError(message)
    return _BACKGROUNDS[value]


def _parse_up(value: object) -> Direction:
    if not isinstance(value, list) or len(value) != 3:
        message = "'up' is not a list of three numbers"
        raise TypeError(message)
    x, y, z = (_parse_number(number, "'up'") for number in value)
    return x, y, z


def _parse_number(value: object, label: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        message = f"{label} is not a number"
        raise TypeError(message)
    return float(value)
