"""Checks that the binary files of a COLMAP model are complete.

pycolmap does not check file sizes. If a file is truncated, pycolmap may read wrong counts, allocate
memory for them, and loop for minutes. This module therefore checks all files whose records vary in
length before pycolmap opens them.
"""

import struct
from collections.abc import Callable
from pathlib import Path

_COUNT_STRUCT = struct.Struct("<Q")
_SHORT_COUNT_STRUCT = struct.Struct("<I")
_IMAGE_HEADER_BYTES = 4 + 7 * 8 + 4  # Image id, quaternion and translation, camera id.
_OBSERVATION_BYTES = 2 * 8 + 8  # Pixel, point id.
_POINT_HEADER_BYTES = 8 + 3 * 8 + 3 + 8  # Point id, position, color, error.
_TRACK_ELEMENT_BYTES = 4 + 4  # Image id, index of the observation.
_SENSOR_BYTES = 4 + 4  # Type, id.
_RIGID_POSE_BYTES = 7 * 8  # Quaternion and translation.
_FRAME_DATA_BYTES = _SENSOR_BYTES + 8  # Sensor, image id.


def require_complete_files(folder: Path) -> None:
    """Check that the length of every binary file of a model matches its records.

    Args:
        folder: Folder of the model; missing files are skipped.

    Raises:
        OSError: A file cannot be read.
        ValueError: A file is shorter or longer than its records.
    """
    for name, skip_record in _SKIP_FUNCTIONS.items():
        path = folder / name
        if path.is_file() and not _has_exact_length(path.read_bytes(), skip_record):
            message = f"the length of {name} does not match its records"
            raise ValueError(message)


def _has_exact_length(data: bytes, skip_record: Callable[[bytes, int], int]) -> bool:
    try:
        (count,) = _COUNT_STRUCT.unpack_from(data)
        position = _COUNT_STRUCT.size
        for _ in range(count):
            position = skip_record(data, position)
    except (IndexError, OverflowError, struct.error, ValueError):
        return False
    return position == len(data)


def _skip_image(data: bytes, position: int) -> int:
    """Return the offset at which an image record ends."""
    name_end = data.index(b"\0", position + _IMAGE_HEADER_BYTES)
    (count,) = _COUNT_STRUCT.unpack_from(data, name_end + 1)
    return name_end + 1 + _COUNT_STRUCT.size + _OBSERVATION_BYTES * int(count)


def _skip_point(data: bytes, position: int) -> int:
    """Return the offset at which a point record ends."""
    (count,) = _COUNT_STRUCT.unpack_from(data, position + _POINT_HEADER_BYTES)
    return position + _POINT_HEADER_BYTES + _COUNT_STRUCT.size + _TRACK_ELEMENT_BYTES * int(count)


def _skip_rig(data: bytes, position: int) -> int:
    """Return the offset at which a rig record ends.

    A rig record has an id and a list of sensors. All sensors except the first may have a pose.
    """
    (count,) = _SHORT_COUNT_STRUCT.unpack_from(data, position + 4)
    position += 4 + _SHORT_COUNT_STRUCT.size + _SENSOR_BYTES * min(int(count), 1)
    for _ in range(int(count) - 1):
        has_pose = data[position + _SENSOR_BYTES]
        position += _SENSOR_BYTES + 1 + _RIGID_POSE_BYTES * bool(has_pose)
    return position


def _skip_frame(data: bytes, position: int) -> int:
    """Return the offset at which a frame record (id, rig id, pose and images) ends."""
    position += 4 + 4 + _RIGID_POSE_BYTES
    (count,) = _SHORT_COUNT_STRUCT.unpack_from(data, position)
    return position + _SHORT_COUNT_STRUCT.size + _FRAME_DATA_BYTES * int(count)


_SKIP_FUNCTIONS: dict[str, Callable[[bytes, int], int]] = {
    "images.bin": _skip_image,
    "points3D.bin": _skip_point,
    "rigs.bin": _skip_rig,
    "frames.bin": _skip_frame,
}
