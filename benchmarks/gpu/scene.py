"""Ray-traces a capture in one step, and loads it from files in the other steps."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from gpu.plan import Sizes
from gpu.rows import Row, RowLog
from quarc_ref.datasets.capture import Capture, Image, Points, join_points
from quarc_ref.format.cameras import Camera
from quarc_ref.synth.options import SynthOptions, make_generator
from quarc_ref.synth.rig import RigCamera, place_cameras
from quarc_ref.synth.scene import make_scene
from quarc_ref.synth.tracer import trace_points, trace_view

FRAME_COUNT = 3
_NEAR_FACTOR = 0.95
_ARRAYS_FILE_NAME = "scene.npz"


def run(sizes: Sizes, folder: Path, row_log: RowLog) -> None:
    """Ray-trace the pictures of the training views, and about one initial point per Gaussian."""
    options = _choose_options(sizes)
    cameras = place_cameras(options)[1:]
    scene = make_scene(options.seed, options.variant_properties)
    arrays_per_frame = [
        scene.at_time(frame / options.frames_per_second) for frame in range(FRAME_COUNT)
    ]
    pictures = np.empty((FRAME_COUNT, len(cameras), sizes.height, sizes.width, 3), dtype=np.uint8)
    nearest = np.full(len(cameras), np.inf)

    def trace(frame_and_view: tuple[int, int]) -> None:
        frame, view = frame_and_view
        traced = trace_view(arrays_per_frame[frame], cameras[view])
        pictures[frame_and_view] = traced.picture
        nearest[view] = min(nearest[view], traced.min_depth)

    for frame in range(FRAME_COUNT):
        row_log.write_progress(f"{frame} of {FRAME_COUNT} frames")
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(trace, ((frame, view) for view in range(len(cameras)))))
    generator = make_generator(options.seed, "points")
    points_per_view = -(-sizes.gaussians // len(cameras))
    points = join_points(
        [
            trace_points(arrays_per_frame[0], camera, picture, points_per_view, generator)
            for camera, picture in zip(cameras, pictures[0], strict=True)
        ]
    )
    np.save(folder / "pictures.npy", pictures)
    np.savez(
        folder / _ARRAYS_FILE_NAME,
        positions=points.positions,
        colors=points.colors,
        nearest=nearest,
    )
    summary = f"{FRAME_COUNT} frames of {sizes.width} x {sizes.height}, {len(cameras)} views"
    row_log.add(Row("scene", "traced", summary))


def load_capture(sizes: Sizes, folder: Path) -> Capture:
    """Return the ray-traced capture; all its cameras are training views.

    Raises:
        RuntimeError: The capture has not been traced.
    """
    if not (folder / _ARRAYS_FILE_NAME).exists():
        message = "the scene has not been traced: the step `scene` must run first"
        raise RuntimeError(message)
    arrays = np.load(folder / _ARRAYS_FILE_NAME)
    cameras = [
        _make_camera(f"cam{index:02}", camera, float(near))
        for index, (camera, near) in enumerate(
            zip(place_cameras(_choose_options(sizes))[1:], arrays["nearest"], strict=True), 1
        )
    ]
    pictures = np.load(folder / "pictures.npy", mmap_mode="r")
    points = Points(arrays["positions"], arrays["colors"])
    return Capture(
        "traced", cameras, FRAME_COUNT, 30.0, points, _StoredPictures(pictures), "0" * 64
    )


class _StoredPictures:
    """The pictures of a capture, stored in a NumPy file."""

    def __init__(self, pictures: np.ndarray) -> None:
        self._pictures = pictures

    def read(self, camera: int, frame: int) -> Image:
        """See `PictureSource.read`."""
        return np.array(self._pictures[frame, camera])


def _choose_options(sizes: Sizes) -> SynthOptions:
    return SynthOptions(sizes.width, sizes.height, FRAME_COUNT, cameras=sizes.views)


def _make_camera(name: str, camera: RigCamera, nearest: float) -> Camera:
    size = (camera.width, camera.height)
    intrinsics = (camera.focal_length, camera.focal_length, camera.width / 2, camera.height / 2)
    rotation = tuple(camera.axes.ravel().tolist())
    translation = tuple((-camera.axes @ camera.center).tolist())
    return Camera(name, *size, *intrinsics, rotation, translation, _NEAR_FACTOR * nearest, False)
