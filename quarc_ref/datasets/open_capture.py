"""From a folder to a `Capture`: the way in for encoder and evaluation.

The layout is told by the files in the folder. Its loader gives the footage as
it is on disk; here pictures become those of pinholes, at the size asked for,
and what no file tells is found: initial points, and each camera's near bound.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from quarc_ref.datasets.calibration import CalibratedCamera, choose_near, measure_depths
from quarc_ref.datasets.capture import Capture, PictureSource, Points
from quarc_ref.datasets.colmap import find_model, read_colmap
from quarc_ref.datasets.errors import (
    HeldOutError,
    UnknownLayoutError,
    UnreadablePointsError,
    UnsupportedCameraError,
)
from quarc_ref.datasets.footage import Footage, compute_fingerprint
from quarc_ref.datasets.n3dv import POSES_NAME, read_n3dv
from quarc_ref.datasets.pictures import RectifiedPictures
from quarc_ref.datasets.transforms_json import TRANSFORMS_NAME, read_nerfstudio
from quarc_ref.datasets.triangulation import triangulate
from quarc_ref.datasets.undistortion import Rectifier
from quarc_ref.format.cameras import Camera


@dataclass(frozen=True, slots=True)
class CaptureOptions:
    """What to make of a capture.

    Attributes:
        downscale: Times that pictures are made smaller.
        held_out: Names of the cameras to keep for evaluation; none for the first one.
        max_frames: Frames taken at most, from the first on; None for all.

    Raises:
        ValueError: A number is not positive.
    """

    downscale: int = 1
    held_out: tuple[str, ...] = ()
    max_frames: int | None = None

    def __post_init__(self) -> None:
        if self.downscale < 1 or (self.max_frames is not None and self.max_frames < 1):
            message = "downscale and max_frames must be at least 1"
            raise ValueError(message)


_DEFAULTS = CaptureOptions()


def open_capture(path: Path, options: CaptureOptions = _DEFAULTS) -> Capture:
    """Return the capture in a folder.

    Args:
        path: Of the folder, in a layout of `n3dv`, `transforms_json` or `colmap`.
        options: What to make of it.

    Raises:
        CaptureError: The folder is no capture that can be used; the message
            says which file is wrong, and what to do.
        DownscaleError: The pictures cannot be made as small as asked for.
    """
    footage = _read_footage(path)
    held_out = _choose_held_out([camera.name for camera in footage.cameras], options.held_out)
    rectifiers = [_make_rectifier(camera, options.downscale) for camera in footage.cameras]
    cameras = [
        replace(camera, lens=rectifier.lens)
        for camera, rectifier in zip(footage.cameras, rectifiers, strict=True)
    ]
    source = RectifiedPictures(footage.source, [camera.name for camera in cameras], rectifiers)
    points = footage.points or _find_points(cameras, source, held_out)
    frame_count, uneven = _bound_frames(footage, options.max_frames)
    return Capture(
        name=path.resolve().name,
        cameras=[_make_camera(camera, points, held_out) for camera in cameras],
        frame_count=frame_count,
        frames_per_second=footage.frames_per_second,
        points=points,
        source=source,
        fingerprint=compute_fingerprint(path, footage.files),
        uneven=uneven,
    )


def _read_footage(path: Path) -> Footage:
    if (path / POSES_NAME).is_file():
        return read_n3dv(path)
    if (path / TRANSFORMS_NAME).is_file():
        return read_nerfstudio(path)
    model = find_model(path)
    if model is not None:
        return read_colmap(path, model)
    message = (
        f"{path} is no capture that is known: it has neither {POSES_NAME} (N3DV), nor "
        f"{TRANSFORMS_NAME} (nerfstudio), nor sparse/0/cameras.bin or .txt (COLMAP)"
    )
    raise UnknownLayoutError(message)


def _bound_frames(footage: Footage, most: int | None) -> tuple[int, str | None]:
    """Return how many frames to take, and why not all, as a `Capture` has both."""
    if most is None or most > footage.frame_count:
        return footage.frame_count, footage.uneven
    return most, None


def _choose_held_out(names: Sequence[str], asked: Sequence[str]) -> frozenset[str]:
    """Return the names of the held-out cameras."""
    unknown = sorted(set(asked) - set(names))
    if unknown:
        message = f"there is no camera {', '.join(unknown)} to hold out, but {', '.join(names)}"
        raise HeldOutError(message)
    held_out = frozenset(asked or names[:1])
    if len(held_out) == len(names):
        message = f"no camera is left to train with, of {', '.join(names)}"
        raise HeldOutError(message)
    return held_out


def _make_rectifier(camera: CalibratedCamera, downscale: int) -> Rectifier:
    try:
        return Rectifier(camera.lens, downscale)
    except UnsupportedCameraError as error:
        message = f"camera {camera.name}: {error}"
        raise UnsupportedCameraError(message) from error


def _find_points(
    cameras: Sequence[CalibratedCamera], source: PictureSource, held_out: frozenset[str]
) -> Points:
    """Return points triangulated without a look at the held-out cameras."""
    training = [index for index, camera in enumerate(cameras) if camera.name not in held_out]
    pictures = [source.read(index, 0) for index in training]
    return triangulate([cameras[index] for index in training], pictures)


def _make_camera(camera: CalibratedCamera, points: Points, held_out: frozenset[str]) -> Camera:
    near = camera.near
    if near is None:
        depths = measure_depths(camera, points.positions)
        if not depths.size:
            message = (
                f"camera {camera.name} sees none of the {len(points.positions)} initial points: "
                "check its pose, or bring points of the whole scene"
            )
            raise UnreadablePointsError(message)
        near = choose_near(depths)
    lens = camera.lens
    return Camera(
        name=camera.name,
        width=lens.width,
        height=lens.height,
        fx=lens.fx,
        fy=lens.fy,
        cx=lens.cx,
        cy=lens.cy,
        rotation=tuple(camera.pose.rotation.ravel().tolist()),
        translation=tuple(camera.pose.translation.tolist()),
        near=near,
        held_out=camera.name in held_out,
    )
