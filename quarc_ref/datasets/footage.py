"""The result of loading a capture: calibrated cameras, and pictures as stored on disk.

`open_capture` converts `Footage` to a `Capture`. The fingerprint identifies a capture, and is
computed without reading all pictures.
"""

import hashlib
import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.datasets.calibration import CalibratedCamera
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.errors import MissingFileError
from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.masks import FileMasks
from quarc_ref.datasets.notes_file import without_ignored_frames
from quarc_ref.datasets.pictures import Pictures

_SAMPLE_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class CaptureFiles:
    """The files of a capture.

    Attributes:
        description_files: Files of poses and points, which are hashed completely.
        media_files: Video, picture and mask files of all frames; their names and sizes are hashed.
        sampled_files: All mask files, and the video and picture files of frame 0; their first and
            last MiB are hashed as well.
    """

    description_files: tuple[Path, ...]
    media_files: tuple[Path, ...]
    sampled_files: tuple[Path, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Footage:
    """A capture as stored on disk, before undistortion and synchronization.

    Attributes:
        cameras: Cameras in the order of their names.
        source: Pictures as stored on disk.
        points: Initial points; None to triangulate them.
        description_files: Files of poses and points.
        stated_frame_rate: Frame rate that a description file states; None to use the frame rate of
            `source`.
        findings: Problems that the loader found, and assumptions that it made.
        masks: Masks of the pictures on disk; None if the capture has no masks.
    """

    cameras: tuple[CalibratedCamera, ...]
    source: Pictures
    points: Points | None
    description_files: tuple[Path, ...]
    stated_frame_rate: float | None = None
    findings: tuple[Finding, ...] = ()
    masks: FileMasks | None = None

    @property
    def frame_count(self) -> int:
        """Number of frames that all cameras have."""
        return min(self.source.lengths)

    @property
    def frames_per_second(self) -> float:
        """Frame rate of all cameras."""
        return self.stated_frame_rate or self.source.frames_per_second

    @property
    def files(self) -> CaptureFiles:
        """Files from which the footage was read."""
        masks = self.masks.paths if self.masks else ()
        return CaptureFiles(
            self.description_files,
            media_files=(
                *(path for camera_paths in self.source.paths for path in camera_paths),
                *masks,
            ),
            sampled_files=(*(camera_paths[0] for camera_paths in self.source.paths), *masks),
        )


def compute_fingerprint(folder: Path, files: CaptureFiles) -> str:
    """Return a SHA-256 digest, in hex digits, that identifies the files of a capture.

    Args:
        folder: Folder of the capture. Hashed file names are relative to the folder, so moving the
            folder does not change the digest.
        files: Files of the capture.

    Raises:
        MissingFileError: A file no longer exists, or cannot be read.
    """
    digest = hashlib.sha256()
    try:
        descriptions = {path: _read_description(path) for path in files.description_files}
        for name, path in _sort_by_name(folder, {*files.description_files, *files.media_files}):
            size = len(descriptions[path]) if path in descriptions else path.stat().st_size
            digest.update(json.dumps([name, size]).encode())
        for _, path in _sort_by_name(folder, files.description_files):
            digest.update(descriptions[path])
        for _, path in _sort_by_name(folder, files.sampled_files):
            digest.update(_read_ends(path))
    except OSError as error:
        raise MissingFileError.of(error.filename, error) from error
    return digest.hexdigest()


def _read_description(path: Path) -> bytes:
    """Return the contents of a file of poses, points or notes, without ignored frames.

    If a camera fails in the middle of an encode, its frames can be ignored from there on, and the
    encode can be resumed.
    """
    data = path.read_bytes()
    return without_ignored_frames(data) if path.name == NOTES_NAME else data


def _sort_by_name(folder: Path, paths: Iterable[Path]) -> list[tuple[str, Path]]:
    return sorted((Path(os.path.relpath(path, folder)).as_posix(), path) for path in paths)


def _read_ends(path: Path) -> bytes:
    """Return the first and the last MiB of a file, which may overlap."""
    with path.open("rb") as file:
        first = file.read(_SAMPLE_BYTES)
        file.seek(max(0, path.stat().st_size - _SAMPLE_BYTES))
        return first + file.read(_SAMPLE_BYTES)
