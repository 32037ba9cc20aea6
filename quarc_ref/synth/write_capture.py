"""Writes a synthetic capture: videos, `poses_bounds.npy`, `points3D_init.ply`, and masks if wanted.

A capture is written completely or not at all. The same options produce the same bytes on
the same machine.
"""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from quarc_ref.datasets.capture import Image, Points, join_points
from quarc_ref.datasets.capture_notes import NOTES_NAME, CaptureNotes
from quarc_ref.datasets.notes_file import write_capture_notes
from quarc_ref.datasets.points_ply import write_points_ply
from quarc_ref.datasets.video_writer import build_png
from quarc_ref.files import OutputFolder, written_folder
from quarc_ref.synth.options import SynthOptions, make_generator
from quarc_ref.synth.rig import RigCamera, place_cameras
from quarc_ref.synth.scene import Scene, make_scene
from quarc_ref.synth.scene_arrays import SceneArrays
from quarc_ref.synth.tracer import trace_alpha, trace_points, trace_view
from quarc_ref.synth.write_video import write_video

_POINT_COUNT = 8000


def write_synthetic_capture(
    folder: Path, options: SynthOptions, progress: Callable[[int, int], None] | None = None
) -> None:
    """Ray-trace a scene and write it in the layout of N3DV; the camera `cam00` is held out.

    Args:
        folder: Folder to create; it may exist if it is empty.
        options: Options of the capture.
        progress: Called with the number of finished pictures and the total number of pictures.

    Raises:
        OutputPathError: The folder exists and is not empty.
        OSError: The folder cannot be written.
    """
    folder.absolute().parent.mkdir(parents=True, exist_ok=True)
    with written_folder(folder) as output:
        fill_synthetic_capture(output, options, progress or _ignore_progress)


def _ignore_progress(done: int, total: int) -> None:
    """Do nothing; used if the caller passes no progress function."""


def fill_synthetic_capture(
    folder: OutputFolder, options: SynthOptions, progress: Callable[[int, int], None]
) -> None:
    """Write a synthetic capture to an open output folder; see `write_synthetic_capture`."""
    scene, cameras = make_scene(options.seed, options.variant_properties), place_cameras(options)
    times = [frame / options.frames_per_second for frame in range(options.frames)]
    arrays_per_frame = [scene.at_time(time) for time in times]
    picture_count = len(cameras) * len(arrays_per_frame)
    first_pictures, poses_bounds_rows = [], []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for index, camera in enumerate(cameras):
            views = []
            for view in pool.map(trace_view, arrays_per_frame, map(camera.at_time, times)):
                views.append(view)
                progress(index * len(arrays_per_frame) + len(views), picture_count)
            pictures = [view.picture for view in views]
            write_video(folder.register(f"cam{index:02}.mp4"), pictures, options)
            poses_bounds_rows.append(
                camera.as_poses_bounds_row(
                    min(camera_view.min_depth for camera_view in views),
                    max(camera_view.max_depth for camera_view in views),
                )
            )
            first_pictures.append(pictures[0])
    with folder.open("poses_bounds.npy") as file:
        np.save(file, np.stack(poses_bounds_rows))
    if options.has_masks:
        with folder.create_subfolder("masks") as mask_folder:
            _write_masks(mask_folder, scene, cameras, times)
        write_capture_notes(
            folder.register(NOTES_NAME), CaptureNotes(has_transparent_background=True)
        )
    points = _sample_points(arrays_per_frame[0], cameras[1:], first_pictures[1:], options.seed)
    write_points_ply(folder.register("points3D_init.ply"), points)


def _write_masks(
    folder: OutputFolder, scene: Scene, cameras: Sequence[RigCamera], times: Sequence[float]
) -> None:
    """Write masks of the robot, such as `cam00/0000.png`."""
    background_arrays = scene.background()
    for index, camera in enumerate(cameras):
        with folder.create_subfolder(f"cam{index:02}") as camera_folder:
            for frame, time in enumerate(times):
                alpha = trace_alpha(scene.at_time(time), background_arrays, camera)
                png = build_png(alpha[..., None].repeat(3, axis=2))
                camera_folder.write(f"{frame:04}.png", png)


def _sample_points(
    scene_arrays: SceneArrays, cameras: Sequence[RigCamera], pictures: Sequence[Image], seed: int
) -> Points:
    """Sample points on the surfaces that the cameras see, the same number for each camera."""
    generator = make_generator(seed, "points")
    points_per_camera = -(-_POINT_COUNT // len(cameras))
    return join_points(
        [
            trace_points(scene_arrays, camera, picture, points_per_camera, generator)
            for camera, picture in zip(cameras, pictures, strict=True)
        ]
    )
