"""A traced capture in memory; one step stores its pictures for the others."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from gpu.plan import Sizes
from gpu.rows import Notebook, Row
from quarc_ref.datasets.capture import Capture, Image, Points, join_points
from quarc_ref.format.cameras import Camera
from quarc_ref.synth.options import SynthOptions, make_generator
from quarc_ref.synth.rig import RigCamera, place_cameras
from quarc_ref.synth.scene import make_scene
from quarc_ref.synth.tracer import trace_points, trace_view

FRAMES = 3
_NEAR_MARGIN = 0.95
_NAME = "scene.npz"


def work(sizes: Sizes, folder: Path, notebook: Notebook) -> None:
    """Trace all pictures of the training views, and as many points as Gaussians are needed."""
    options = _choose_options(sizes)
    cameras = place_cameras(options)[1:]
    scene = make_scene(options.seed, options.scene)
    stages = [scene.at_time(frame / options.frames_per_second) for frame in range(FRAMES)]
    pictures = np.empty((FRAMES, len(cameras), sizes.height, sizes.width, 3), dtype=np.uint8)
    nearest = np.full(len(cameras), np.inf)

    def trace(place: tuple[int, int]) -> None:
        frame, view = place
        traced = trace_view(stages[frame], cameras[view])
        pictures[place] = traced.picture
        nearest[view] = min(nearest[view], traced.min_depth)

    for frame in range(FRAMES):
        notebook.note(f"{frame} of {FRAMES} frames")
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(trace, ((frame, view) for view in range(len(cameras)))))
    generator = make_generator(options.seed, "points")
    share = -(-sizes.gaussians // len(cameras))
    points = join_points(
        [
            trace_points(stages[0], camera, picture, share, generator)
            for camera, picture in zip(cameras, pictures[0], strict=True)
        ]
    )
    np.save(folder / "pictures.npy", pictures)
    np.savez(folder / _NAME, positions=points.positions, colors=points.colors, nearest=nearest)
    traced = f"{FRAMES} frames of {sizes.width} x {sizes.height}, {len(cameras)} views"
    notebook.add(Row("scene", "traced", traced))


def load_capture(sizes: Sizes, folder: Path) -> Capture:
    """Return the traced capture, in which all cameras are for training.

    Raises:
        RuntimeError: The capture has not been traced.
    """
    if not (folder / _NAME).exists():
        message = "the scene was not traced"
        raise RuntimeError(message)
    kept = np.load(folder / _NAME)
    cameras = [
        _make_camera(f"cam{index:02}", camera, float(near))
        for index, (camera, near) in enumerate(
            zip(place_cameras(_choose_options(sizes))[1:], kept["nearest"], strict=True), 1
        )
    ]
    pictures = np.load(folder / "pictures.npy", mmap_mode="r")
    points = Points(kept["positions"], kept["colors"])
    return Capture("traced", cameras, FRAMES, 30.0, points, _Kept(pictures), "0" * 64)


class _Kept:
    """Pictures in a file."""

    def __init__(self, pictures: np.ndarray) -> None:
        self._pictures = pictures

    def read(self, camera: int, frame: int) -> Image:
        """See `PictureSource.read`."""
        return np.array(self._pictures[frame, camera])


def _choose_options(sizes: Sizes) -> SynthOptions:
    return SynthOptions(sizes.width, sizes.height, FRAMES, cameras=sizes.views)


def _make_camera(name: str, camera: RigCamera, nearest: float) -> Camera:
    size = (camera.width, camera.height)
    lens = (camera.focal, camera.focal, camera.width / 2, camera.height / 2)
    rotation = tuple(camera.axes.ravel().tolist())
    translation = tuple((-camera.axes @ camera.center).tolist())
    return Camera(name, *size, *lens, rotation, translation, _NEAR_MARGIN * nearest, False)
