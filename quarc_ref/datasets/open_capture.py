"""Opens the capture in a folder, for encoding and evaluation.

The files in the folder determine the layout. The loader of the layout returns cameras and pictures
as stored on disk. `open_capture` undistorts and downscales the pictures, applies time offsets, and
computes missing initial points and near planes.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from quarc_ref.datasets.agreement import require_usable_frame_rate
from quarc_ref.datasets.alphas import find_ignored_alpha
from quarc_ref.datasets.calibration import CalibratedCamera, make_camera
from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.capture_media import open_media
from quarc_ref.datasets.choose_points import choose_points
from quarc_ref.datasets.errors import (
    HeldOutError,
    UnreadableVideoError,
    UnsupportedCameraError,
)
from quarc_ref.datasets.footage import Footage, compute_fingerprint
from quarc_ref.datasets.ignored_frames import IgnoredFrames
from quarc_ref.datasets.layouts.table import choose_layout
from quarc_ref.datasets.masks import FileMasks, find_masks
from quarc_ref.datasets.notes_file import read_capture_notes
from quarc_ref.datasets.orientation import suggest_size_remedy
from quarc_ref.datasets.point_cache import make_cache_key
from quarc_ref.datasets.synchronize import synchronize
from quarc_ref.datasets.undistortion import Rectifier


@dataclass(frozen=True, slots=True)
class CaptureOptions:
    """Options for opening a capture.

    Attributes:
        downscale: Factor by which pictures are downscaled.
        held_out: Names of the cameras to hold out for evaluation; if empty, the first camera.
        max_frames: Maximum number of frames, counted from `start`; None for all frames.
        start: Frame of the synchronized recording that becomes frame 0 of the capture.

    Raises:
        ValueError: `downscale` or `max_frames` is less than 1, or `start` is negative.
    """

    downscale: int = 1
    held_out: tuple[str, ...] = ()
    max_frames: int | None = None
    start: int = 0

    def __post_init__(self) -> None:
        if self.downscale < 1 or (self.max_frames is not None and self.max_frames < 1):
            message = "downscale and max_frames must be at least 1"
            raise ValueError(message)
        if self.start < 0:
            message = f"start is {self.start}, but it must be at least 0"
            raise ValueError(message)


_DEFAULT_OPTIONS = CaptureOptions()


def open_capture(path: Path, options: CaptureOptions = _DEFAULT_OPTIONS) -> Capture:
    """Open the capture in a folder.

    Args:
        path: Path of the folder, in a layout of `layouts.table`.
        options: Cameras to hold out, range of frames, and downscaling.

    Raises:
        CaptureError: The folder is not a usable capture; the message names the file and a remedy.
        DownscaleError: The pictures cannot be downscaled by the requested factor.
    """
    footage, notes = _add_masks(path, choose_layout(path).read(path)), read_capture_notes(path)
    _require_sizes(footage)
    frames_per_second = notes.frames_per_second or footage.frames_per_second
    require_usable_frame_rate(frames_per_second)
    held_out = _choose_held_out([camera.name for camera in footage.cameras], options.held_out)
    rectifiers = [_make_rectifier(camera, options.downscale) for camera in footage.cameras]
    cameras = [
        replace(camera, lens=rectifier.lens)
        for camera, rectifier in zip(footage.cameras, rectifiers, strict=True)
    ]
    names = [camera.name for camera in cameras]
    footage, pictures = synchronize(path, footage, notes, options.start, options.max_frames)
    media = open_media(names, footage, pictures, rectifiers, notes)
    fingerprint = compute_fingerprint(path, footage.files)
    frame_count = min(pictures.frame_count, options.max_frames or pictures.frame_count)
    training = _choose_training(names, held_out, notes.ignored_frames, (options.start, frame_count))
    key = make_cache_key(
        fingerprint, options.start, options.downscale, [names[index] for index in training]
    )
    points = choose_points(footage.points, cameras, training, media, key)
    ignored_alpha = None if media.alphas else find_ignored_alpha(footage, training[0])
    return Capture(
        name=path.resolve().name,
        cameras=[
            make_camera(camera, points.positions, held_out=camera.name in held_out)
            for camera in cameras
        ],
        frame_count=frame_count,
        frames_per_second=frames_per_second,
        points=points,
        source=media.pictures,
        fingerprint=fingerprint,
        findings=(*footage.findings, *filter(None, [ignored_alpha])),
        start=options.start,
        notes=notes,
        masks=media.masks,
        alphas=media.alphas,
        stored_pictures=pictures,
    )


def _add_masks(path: Path, footage: Footage) -> Footage:
    """Add the masks in the capture's folder, unless the loader has already found masks."""
    if footage.masks is not None:
        return footage
    mask_files, findings = find_masks(path, [camera.name for camera in footage.cameras])
    if mask_files is None:
        return footage
    source = footage.source
    masks = FileMasks(mask_files, source.sizes, source.lengths)
    return replace(footage, masks=masks, findings=(*footage.findings, *findings))


def _require_sizes(footage: Footage) -> None:
    """Check that the picture sizes match the calibration."""
    source = footage.source
    for camera, size, rotation in zip(footage.cameras, source.sizes, source.rotations, strict=True):
        calibrated_size = (camera.lens.width, camera.lens.height)
        if size != calibrated_size:
            message = (
                f"frame 0 of camera {camera.name} is {size[0]}x{size[1]}, but its calibration is "
                f"for {camera.lens.width}x{camera.lens.height}: "
                f"{suggest_size_remedy(size, calibrated_size, rotation)}"
            )
            raise UnreadableVideoError(message)


def _choose_held_out(names: Sequence[str], requested_names: Sequence[str]) -> frozenset[str]:
    """Return the names of the held-out cameras."""
    unknown_names = sorted(set(requested_names) - set(names))
    if unknown_names:
        message = (
            f"cannot hold out camera {', '.join(unknown_names)}: the cameras are {', '.join(names)}"
        )
        raise HeldOutError(message)
    held_out = frozenset(requested_names or names[:1])
    if len(names) == 1:
        message = f"{names[0]} is the only camera, and training needs at least two others"
        raise HeldOutError(message)
    if len(held_out) == len(names):
        message = f"all cameras ({', '.join(names)}) are held out: no camera is left for training"
        raise HeldOutError(message)
    return held_out


def _choose_training(
    names: Sequence[str], held_out: Collection[str], ignored: IgnoredFrames, span: tuple[int, int]
) -> list[int]:
    """Return the indices of the training cameras whose first picture is used.

    Args:
        names: Names of all cameras.
        held_out: Names of the held-out cameras.
        ignored: Frames that are not used.
        span: First frame and number of frames of the capture.

    Raises:
        MissingCameraError: See `IgnoredFrames.require_cameras`.
    """
    training = {index: name for index, name in enumerate(names) if name not in held_out}
    ignored.require_cameras(names, list(training.values()), *span)
    return [index for index, name in training.items() if not ignored.contains(name, span[0])]


def _make_rectifier(camera: CalibratedCamera, downscale: int) -> Rectifier:
    try:
        return Rectifier(camera.lens, downscale)
    except UnsupportedCameraError as error:
        message = f"camera {camera.name}: {error}"
        raise UnsupportedCameraError(message) from error
