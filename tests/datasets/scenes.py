"""Small captures from formulas: cameras in front of a painted plane, in every layout."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import av
import cv2
import numpy as np
import pycolmap

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.points_ply import write_points_ply

FRAMES_PER_SECOND = 30


@dataclass(frozen=True)
class Shot:
    """A pinhole camera; its axes are columns: right, down, forward in the world."""

    name: str
    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    axes: np.ndarray
    center: np.ndarray

    def project(self, positions):
        """Return `[P, 3]` pixel x, pixel y and depth, one point at a time."""
        results = []
        for position in positions:
            right, rows, forward = ((position - self.center) @ axis for axis in self.axes.T)
            x = self.fx * right / forward + self.cx
            results.append((x, self.fy * rows / forward + self.cy, forward))
        return np.array(results)


def project(camera, positions):
    """Return `[P, 3]` pixel x, pixel y and depth, as from a calibrated camera."""
    lens, pose = camera.lens, camera.pose
    x, y, z = (positions @ pose.rotation.T + pose.translation).T
    return np.stack([lens.fx * x / z + lens.cx, lens.fy * y / z + lens.cy, z], axis=1)


def look_at(eye, target):
    """Return the axes of a camera in a world with z up."""
    forward = np.subtract(target, eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)


def make_shots(count=4, size=(48, 32), focal=40.0):
    """Return cameras on an arc in front of the plane y = 0, some of them numbered with a gap."""
    width, height = size
    shots = []
    for index in range(count):
        eye = np.array([1.2 * (index - (count - 1) / 2), -4.0 + 0.1 * index, 0.3 * (index % 2)])
        name = f"cam{index + (index > 1):02d}"
        axes = look_at(eye, (0.1, 0.0, -0.05))
        shots.append(Shot(name, width, height, focal, focal, width / 2, height / 2, axes, eye))
    return shots


def paint(x, z, frame_time=0.0):
    """Return sRGB in [0, 255] of the plane y = 0; a disc moves across it."""
    waves = [np.sin(3.1 * x + 1.7 * z), np.sin(2.3 * z - x), np.cos(1.9 * x * z)]
    colors = 127.5 + 80 * np.stack(waves, axis=-1)
    disc = (x - 0.1 * frame_time) ** 2 + z**2 < 0.2
    return np.where(disc[..., None], (230.0, 40.0, 20.0), colors)


def paint_grains(x, z, _moment=0.0):
    """Return sRGB in [0, 255] of a plane with many corners: cells of random gray at two scales."""
    shades = np.random.default_rng(3).uniform(0, 110, size=(2, 64, 64, 3))
    colors = 15.0
    for shade, cells in zip(shades, (4.0, 11.0), strict=True):
        row, column = (np.floor(cells * values).astype(int) % 64 for values in (x, z))
        colors = colors + shade[row, column]
    return colors


def render(shot, frame_time=0.0, painting=paint, samples=2):
    """Return `[H, W, 3]` uint8 of the plane y = 0, each pixel the mean of its samples."""
    steps = (np.arange(samples) + 0.5) / samples
    x = (np.arange(shot.width)[:, None] + steps).ravel()
    y = (np.arange(shot.height)[:, None] + steps).ravel()
    across, rows = np.meshgrid((x - shot.cx) / shot.fx, (y - shot.cy) / shot.fy)
    rays = np.stack([across, rows, np.ones_like(across)], axis=-1) @ shot.axes.T
    distance = -shot.center[1] / rays[..., 1]
    hits = shot.center + distance[..., None] * rays
    colors = painting(hits[..., 0], hits[..., 2], frame_time)
    colors = colors.reshape(shot.height, samples, shot.width, samples, 3).mean(axis=(1, 3))
    return (colors + 0.5).astype(np.uint8)


def plane_points(count=200):
    """Return points of the painted plane."""
    generator = np.random.default_rng(7)
    x, z = generator.uniform(-1.0, 1.0, size=(2, count))
    positions = np.stack([x, np.zeros(count), z], axis=1).astype(np.float32)
    return Points(positions, paint(x, z).astype(np.uint8))


def write_video(
    path, pictures, *, faststart=False, key_interval=4, codec="libx264", rate=FRAMES_PER_SECOND
):
    """Write pictures as a video whose frames are coded out of order."""
    options = {"movflags": "faststart"} if faststart else {}
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream(codec, rate=rate)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.codec_context.gop_size = key_interval
        stream.codec_context.max_b_frames = 2
        for picture in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())


def read_video(path):
    """Return all frames of a video, decoded from its start."""
    with av.open(str(path)) as container:
        return [frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)]


def write_picture(path, picture):
    path.parent.mkdir(parents=True, exist_ok=True)
    assert cv2.imwrite(str(path), picture[..., ::-1])


def poses_row(shot, near=1.5, far=9.0, size=None):
    """Return the row of poses_bounds.npy of a shot."""
    right, rows, forward = shot.axes.T
    width, height = size or (shot.width, shot.height)
    focal = shot.fx * width / shot.width
    columns = [rows, right, -forward, shot.center, (height, width, focal)]
    return np.concatenate([np.stack(columns, axis=1).ravel(), (near, far)])


def write_n3dv(folder, shots, frame_count=6, points=None):
    """Write videos, poses and points in N3DV's layout."""
    folder.mkdir(parents=True, exist_ok=True)
    for shot in shots:
        pictures = [render(shot, frame_time) for frame_time in range(frame_count)]
        write_video(folder / f"{shot.name}.mp4", pictures)
    np.save(folder / "poses_bounds.npy", np.array([poses_row(shot) for shot in shots]))
    if points is not None:
        write_points_ply(folder / "points3D_init.ply", points)
    return folder


def opengl_matrix(shot):
    """Return the 4x4 matrix of transforms.json of a shot."""
    right, rows, forward = shot.axes.T
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, -rows, -forward, shot.center], axis=1)
    return matrix.tolist()


def intrinsics(shot):
    """Return the intrinsics of a shot for transforms.json."""
    return {
        "w": shot.width,
        "h": shot.height,
        "fl_x": shot.fx,
        "fl_y": shot.fy,
        "cx": shot.cx,
        "cy": shot.cy,
    }


def entry(shot, path, **others):
    """Return an entry of transforms.json."""
    matrix = opengl_matrix(shot)
    return {"file_path": path, "transform_matrix": matrix, **intrinsics(shot), **others}


def video_document(shots, **others):
    """Return a transforms.json of videos."""
    return {"frames": [entry(shot, f"{shot.name}.mp4") for shot in shots], **others}


def picture_document(shots, pattern="frames/{frame:04d}/{name}.png", frames=6):
    """Return a transforms.json of pictures, with the last frame first and cameras mixed."""
    entries = [
        entry(shot, pattern.format(frame=frame, name=shot.name), time=frame / 10)
        for frame in reversed(range(frames))
        for shot in shots
    ]
    return {"frames": entries}


def write_transforms(folder, document, points=None):
    """Write transforms.json, and points if given."""
    folder.mkdir(parents=True, exist_ok=True)
    if points is not None:
        write_points_ply(folder / "points.ply", points)
        document = {**document, "ply_file_path": "points.ply"}
    (folder / "transforms.json").write_text(json.dumps(document))
    return folder


def write_model(folder, shots, points=None, *, model="PINHOLE", extra=(), text=False):
    """Write a COLMAP model of shots; every second point is seen by every camera."""
    folder.mkdir(parents=True, exist_ok=True)
    reconstruction = pycolmap.Reconstruction()
    positions = [] if points is None else points.positions
    for index, shot in enumerate(shots, start=1):
        camera = pycolmap.Camera(
            model=model,
            width=shot.width,
            height=shot.height,
            params=[shot.fx, shot.fy, shot.cx, shot.cy, *extra],
            camera_id=index,
        )
        reconstruction.add_camera_with_trivial_rig(camera)
        seen = shot.project(positions[::2])[:, :2] if len(positions) else np.empty((0, 2))
        image = pycolmap.Image(f"{shot.name}.png", seen, index, index)
        rotation = shot.axes.T
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ shot.center)
        reconstruction.add_image_with_trivial_frame(image, pose)
    for row, position in enumerate(positions):
        track = pycolmap.Track()
        for index in range(1, len(shots) + 1):
            if row % 2 == 0:
                track.add_element(index, row // 2)
        reconstruction.add_point3D(np.asarray(position, float), track, points.colors[row])
    (reconstruction.write_text if text else reconstruction.write_binary)(folder)
    return folder


def write_frames(folder, shots, pictures: Sequence[Sequence[np.ndarray]], first=0):
    """Write `[camera][frame]` pictures as frames/NNNN/<camera>.png."""
    for shot, row in zip(shots, pictures, strict=True):
        for frame, picture in enumerate(row, start=first):
            write_picture(Path(folder) / "frames" / f"{frame:04d}" / f"{shot.name}.png", picture)
    return folder


def rename(shots, names):
    return [replace(shot, name=name) for shot, name in zip(shots, names, strict=True)]
