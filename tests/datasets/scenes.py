"""Makes small captures of a painted plane in every layout."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pycolmap
from av.video.reformatter import ColorTrc

from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.points_ply import write_points_ply

FRAMES_PER_SECOND = 30
VIDEO_FRAME_COUNT = 11  # of the fixture `video`
_UNSTATED_MATRIX = 2
_UNSTATED_ASPECT = Fraction(0)


@dataclass(frozen=True)
class Shot:
    """A pinhole camera; the columns of `axes` are right, down and forward in the world."""

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
        """Return `[P, 3]`: pixel x, pixel y and depth of each position."""
        results = []
        for position in positions:
            right, down, forward = ((position - self.center) @ axis for axis in self.axes.T)
            x = self.fx * right / forward + self.cx
            results.append((x, self.fy * down / forward + self.cy, forward))
        return np.array(results)


def project(camera, positions):
    """Return `[P, 3]`: pixel x, pixel y and depth of each position in a calibrated camera."""
    lens, pose = camera.lens, camera.pose
    x, y, z = (positions @ pose.rotation.T + pose.translation).T
    return np.stack([lens.fx * x / z + lens.cx, lens.fy * y / z + lens.cy, z], axis=1)


def look_at(center, target):
    """Return the axes of a camera in a world with z up."""
    forward = np.subtract(target, center)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right = right / np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1)


def make_shots(count=4, size=(48, 32), focal=40.0):
    """Return cameras on an arc in front of the plane y = 0; the number 2 is missing in names."""
    width, height = size
    shots = []
    for index in range(count):
        center = np.array([1.2 * (index - (count - 1) / 2), -4.0 + 0.1 * index, 0.3 * (index % 2)])
        name = f"cam{index + (index > 1):02d}"
        axes = look_at(center, (0.1, 0.0, -0.05))
        shots.append(Shot(name, width, height, focal, focal, width / 2, height / 2, axes, center))
    return shots


def paint(x, z, frame_time=0.0):
    """Return the sRGB color in [0, 255] of the plane y = 0, across which a disc moves."""
    channels = [np.sin(3.1 * x + 1.7 * z), np.sin(2.3 * z - x), np.cos(1.9 * x * z)]
    colors = 127.5 + 80 * np.stack(channels, axis=-1)
    in_disc = (x - 0.1 * frame_time) ** 2 + z**2 < 0.2
    return np.where(in_disc[..., None], (230.0, 40.0, 20.0), colors)


def paint_grains(x, z, _frame_time=0.0):
    """Return the sRGB color in [0, 255] of a plane with corners: random cells at two scales."""
    grids = np.random.default_rng(3).uniform(0, 110, size=(2, 64, 64, 3))
    colors = 15.0
    for grid, cells_per_unit in zip(grids, (4.0, 11.0), strict=True):
        row, column = (np.floor(cells_per_unit * values).astype(int) % 64 for values in (x, z))
        colors = colors + grid[row, column]
    return colors


def render(shot, frame_time=0.0, painting=paint, samples=2):
    """Return a picture `[H, W, 3]` (uint8) of the plane y = 0; pixels are means of samples."""
    sample_offsets = (np.arange(samples) + 0.5) / samples
    x = (np.arange(shot.width)[:, None] + sample_offsets).ravel()
    y = (np.arange(shot.height)[:, None] + sample_offsets).ravel()
    right, down = np.meshgrid((x - shot.cx) / shot.fx, (y - shot.cy) / shot.fy)
    rays = np.stack([right, down, np.ones_like(right)], axis=-1) @ shot.axes.T
    distance = -shot.center[1] / rays[..., 1]
    hit_points = shot.center + distance[..., None] * rays
    colors = painting(hit_points[..., 0], hit_points[..., 2], frame_time)
    colors = colors.reshape(shot.height, samples, shot.width, samples, 3).mean(axis=(1, 3))
    return (colors + 0.5).astype(np.uint8)


def make_plane_points(count=200):
    """Return points of the painted plane."""
    generator = np.random.default_rng(7)
    x, z = generator.uniform(-1.0, 1.0, size=(2, count))
    positions = np.stack([x, np.zeros(count), z], axis=1).astype(np.float32)
    return Points(positions, paint(x, z).astype(np.uint8))


def write_video(
    path,
    pictures,
    *,
    faststart=False,
    key_interval=4,
    codec="libx264",
    rate=FRAMES_PER_SECOND,
    transfer=ColorTrc.UNSPECIFIED,
    matrix=_UNSTATED_MATRIX,
    codec_options=None,
    pixel_aspect=_UNSTATED_ASPECT,
):
    """Write pictures as a video with B-frames."""
    options = {"movflags": "faststart"} if faststart else {}
    with av.open(str(path), "w", options=options) as container:
        stream = container.add_stream(codec, rate=rate, options=codec_options or {})
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        stream.codec_context.sample_aspect_ratio = pixel_aspect
        stream.codec_context.gop_size = key_interval
        stream.codec_context.max_b_frames = 2
        stream.codec_context.color_trc = transfer
        stream.codec_context.colorspace = matrix
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


def make_poses_row(shot, near=1.5, far=9.0, size=None):
    """Return the row of poses_bounds.npy for a camera."""
    right, down, forward = shot.axes.T
    width, height = size or (shot.width, shot.height)
    focal = shot.fx * width / shot.width
    columns = [down, right, -forward, shot.center, (height, width, focal)]
    return np.concatenate([np.stack(columns, axis=1).ravel(), (near, far)])


def write_n3dv(folder, shots, frame_count=6, points=None):
    """Write videos, poses and points in N3DV's layout."""
    folder.mkdir(parents=True, exist_ok=True)
    for shot in shots:
        pictures = [render(shot, frame_time) for frame_time in range(frame_count)]
        write_video(folder / f"{shot.name}.mp4", pictures)
    np.save(folder / "poses_bounds.npy", np.array([make_poses_row(shot) for shot in shots]))
    if points is not None:
        write_points_ply(folder / "points3D_init.ply", points)
    return folder


def make_opengl_matrix(shot):
    """Return the 4x4 matrix in transforms.json for a camera."""
    right, down, forward = shot.axes.T
    matrix = np.eye(4)
    matrix[:3] = np.stack([right, -down, -forward, shot.center], axis=1)
    return matrix.tolist()


def make_intrinsics(shot):
    """Return the intrinsics in transforms.json for a camera."""
    return {
        "w": shot.width,
        "h": shot.height,
        "fl_x": shot.fx,
        "fl_y": shot.fy,
        "cx": shot.cx,
        "cy": shot.cy,
    }


def make_entry(shot, path, **extra_keys):
    """Return a frame entry of transforms.json."""
    matrix = make_opengl_matrix(shot)
    return {"file_path": path, "transform_matrix": matrix, **make_intrinsics(shot), **extra_keys}


def make_video_document(shots, **extra_keys):
    """Return the content of a transforms.json that names a video for each camera."""
    return {"frames": [make_entry(shot, f"{shot.name}.mp4") for shot in shots], **extra_keys}


def make_picture_document(shots, pattern="frames/{frame:04d}/{name}.png", frame_count=6):
    """Return the content of a transforms.json of pictures, in reverse order of frames."""
    entries = [
        make_entry(shot, pattern.format(frame=frame, name=shot.name), time=frame / 10)
        for frame in reversed(range(frame_count))
        for shot in shots
    ]
    return {"frames": entries}


def write_transforms(folder, document, points=None):
    """Write transforms.json, and a PLY file if points are given."""
    folder.mkdir(parents=True, exist_ok=True)
    if points is not None:
        write_points_ply(folder / "points.ply", points)
        document = {**document, "ply_file_path": "points.ply"}
    (folder / "transforms.json").write_text(json.dumps(document))
    return folder


def write_model(folder, shots, points=None, *, model="PINHOLE", extra_params=(), text=False):
    """Write a COLMAP model; every camera sees every second point."""
    folder.mkdir(parents=True, exist_ok=True)
    reconstruction = pycolmap.Reconstruction()
    positions = [] if points is None else points.positions
    for index, shot in enumerate(shots, start=1):
        camera = pycolmap.Camera(
            model=model,
            width=shot.width,
            height=shot.height,
            params=[shot.fx, shot.fy, shot.cx, shot.cy, *extra_params],
            camera_id=index,
        )
        reconstruction.add_camera_with_trivial_rig(camera)
        pixel_positions = (
            shot.project(positions[::2])[:, :2] if len(positions) else np.empty((0, 2))
        )
        image = pycolmap.Image(f"{shot.name}.png", pixel_positions, index, index)
        rotation = shot.axes.T
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(rotation), -rotation @ shot.center)
        reconstruction.add_image_with_trivial_frame(image, pose)
    for point_index, position in enumerate(positions):
        track = pycolmap.Track()
        for index in range(1, len(shots) + 1):
            if point_index % 2 == 0:
                track.add_element(index, point_index // 2)
        reconstruction.add_point3D(np.asarray(position, float), track, points.colors[point_index])
    (reconstruction.write_text if text else reconstruction.write_binary)(folder)
    return folder


def write_frames(folder, shots, pictures: Sequence[Sequence[np.ndarray]], first_frame=0):
    """Write `[camera][frame]` pictures as frames/NNNN/<camera>.png."""
    for shot, camera_pictures in zip(shots, pictures, strict=True):
        for frame, picture in enumerate(camera_pictures, start=first_frame):
            write_picture(Path(folder) / "frames" / f"{frame:04d}" / f"{shot.name}.png", picture)
    return folder


def rename_shots(shots, names):
    return [replace(shot, name=name) for shot, name in zip(shots, names, strict=True)]
