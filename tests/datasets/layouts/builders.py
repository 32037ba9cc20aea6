"""The traced capture in every supported layout."""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

import av
import cv2
import numpy as np

from quarc_ref.datasets.capture import Capture
from tests.datasets import scenes


@dataclass(frozen=True, eq=False)
class TracedCapture:
    """A traced capture: its folder, the opened capture, and `[camera][frame]` pictures."""

    folder: Path
    capture: Capture
    pictures: list

    @property
    def shots(self):
        """The cameras, as `scenes` writes them into models and documents."""
        return [make_shot(camera) for camera in self.capture.cameras]

    @property
    def names(self):
        return [camera.name for camera in self.capture.cameras]

    def copy_videos(self, folder, pattern="{name}.mp4"):
        """Copy the videos to names that follow from their name and index."""
        for index, name in enumerate(self.names):
            target = folder / pattern.format(name=name, index=index)
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(self.folder / f"{name}.mp4", target)

    def write_stills(self, folder, pattern, frames=None):
        """Write the pictures to names that follow from camera, index and frame."""
        for index, name in enumerate(self.names):
            for frame, picture in enumerate(self.pictures[index][:frames]):
                path = folder / pattern.format(name=name, index=index, frame=frame)
                write_still(path, picture)


def write_still(path, picture):
    """Write a PNG file, or a JPEG file of the best quality."""
    path.parent.mkdir(parents=True, exist_ok=True)
    best = [
        *(cv2.IMWRITE_JPEG_QUALITY, 100),
        *(cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444),
    ]
    assert cv2.imwrite(str(path), picture[..., ::-1], best if path.suffix == ".jpg" else [])


def make_shot(camera):
    rotation = np.array(camera.rotation).reshape(3, 3)
    center = -rotation.T @ np.array(camera.translation)
    lens = (camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    return scenes.Shot(camera.name, *lens, rotation.T, center)


def write_poses(traced_capture, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("poses_bounds.npy", "points3D_init.ply"):
        shutil.copy(traced_capture.folder / name, folder / name)


def build_n3dv(traced_capture, folder):
    shutil.copytree(traced_capture.folder, folder)


def build_n3dv_mov(traced_capture, folder):
    write_poses(traced_capture, folder)
    traced_capture.copy_videos(folder, "{name}.MOV")


def build_n3dv_matroska(traced_capture, folder):
    write_poses(traced_capture, folder)
    for name in traced_capture.names:
        remux(traced_capture.folder / f"{name}.mp4", folder / f"{name}.mkv")


def build_n3dv_any_names(traced_capture, folder):
    write_poses(traced_capture, folder)
    traced_capture.copy_videos(folder, "GOPR{index:03}.MP4")


def build_meetroom_with_poses(traced_capture, folder):
    write_poses(traced_capture, folder)
    traced_capture.copy_videos(folder, "cam_{index}.mp4")


def build_n3dv_picture_folders(traced_capture, folder):
    write_poses(traced_capture, folder)
    traced_capture.write_stills(folder, "{name}/{frame:04}.png")


def build_n3dv_extracted(traced_capture, folder):
    write_poses(traced_capture, folder)
    traced_capture.write_stills(folder, "{name}/images/{frame:04}.png")


def build_colmap_project(traced_capture, folder):
    traced_capture.write_stills(folder, "images/{name}.png", frames=1)
    write_model(traced_capture, folder)


def build_colmap_folders(traced_capture, folder):
    traced_capture.write_stills(folder, "images/{name}/{frame:04}.png")
    write_model(traced_capture, folder, "{name}/0000")


def build_colmap_odd_stems(traced_capture, folder):
    traced_capture.write_stills(folder, "images/{name}/shot{index}_{frame:04}.png")
    write_model(traced_capture, folder, "{name}/shot{index}_0000")


def build_colmap_frames(traced_capture, folder):
    traced_capture.write_stills(folder, "frames/{frame:04}/{name}.png")
    write_model(traced_capture, folder)


def build_colmap_videos(traced_capture, folder):
    traced_capture.copy_videos(folder)
    write_model(traced_capture, folder, text=True)


def build_colmap_videos_folder(traced_capture, folder):
    traced_capture.copy_videos(folder, "videos/{name}.mov")
    write_model(traced_capture, folder)


def build_meetroom(traced_capture, folder):
    traced_capture.copy_videos(folder, "cam_{index}.mp4")
    write_model(traced_capture, folder, "cam_{index}")


def build_nerfstudio_videos(traced_capture, folder):
    traced_capture.copy_videos(folder)
    document = scenes.make_video_document(traced_capture.shots)
    scenes.write_transforms(folder, document, traced_capture.capture.points)


def build_nerfstudio_pictures(traced_capture, folder):
    traced_capture.write_stills(folder, "frames/{frame:04}/{name}.png")
    document = scenes.make_picture_document(traced_capture.shots, frame_count=3)
    scenes.write_transforms(folder, document, traced_capture.capture.points)


def build_nerfstudio_without_times(traced_capture, folder):
    traced_capture.write_stills(folder, "images/{name}/frame_{frame:05}.png")
    entries = [
        scenes.make_entry(shot, f"images/{shot.name}/frame_{frame:05}.png")
        for frame in (2, 0, 1)
        for shot in traced_capture.shots
    ]
    scenes.write_transforms(folder, {"frames": entries}, traced_capture.capture.points)


def build_easymocap(traced_capture, folder):
    traced_capture.write_stills(folder, "images/{index:02}/{frame:06}.jpg")
    write_easymocap_calibration(traced_capture, folder)


def build_easymocap_videos(traced_capture, folder):
    traced_capture.copy_videos(folder, "videos/{index:02}.mp4")
    write_easymocap_calibration(traced_capture, folder, rotation="R")


def build_panoptic_videos(traced_capture, folder):
    traced_capture.copy_videos(folder, "hdVideos/hd_00_{index:02}.mp4")
    write_panoptic_calibration(traced_capture, folder)


def build_panoptic_pictures(traced_capture, folder):
    traced_capture.write_stills(folder, "hdImgs/00_{index:02}/00_{index:02}_{frame:08}.jpg")
    write_panoptic_calibration(traced_capture, folder)


BUILDERS = {
    name.removeprefix("build_"): build
    for name, build in list(globals().items())
    if name.startswith("build_")
}


def remux(source, target, **options):
    """Copy a video into another container without recoding."""
    with av.open(str(source)) as source_video, av.open(str(target), "w", options=options) as made:
        stream = made.add_stream_from_template(source_video.streams.video[0])
        for packet in source_video.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                made.mux(packet)


def write_model(traced_capture, folder, pattern="{name}", *, text=False):
    names = [pattern.format(name=name, index=i) for i, name in enumerate(traced_capture.names)]
    shots, points = scenes.rename_shots(traced_capture.shots, names), traced_capture.capture.points
    scenes.write_model(folder / "sparse" / "0", shots, points, text=text)


def write_easymocap_calibration(traced_capture, folder, rotation="Rot"):
    """Write intri.yml and extri.yml with OpenCV, like EasyMocap."""
    names = [f"{index:02}" for index in range(len(traced_capture.shots))]
    inner, outer = (
        cv2.FileStorage(str(folder / name), cv2.FILE_STORAGE_WRITE)
        for name in ("intri.yml", "extri.yml")
    )
    for file in (inner, outer):
        file.startWriteStruct("names", cv2.FileNode_SEQ)
        for name in names:
            file.write("", name)
        file.endWriteStruct()
    for name, shot in zip(names, traced_capture.shots, strict=True):
        inner.write(f"K_{name}", opencv_matrix(shot))
        inner.write(f"dist_{name}", np.zeros((1, 5)))
        matrix = shot.axes.T
        rotation_vector = matrix if rotation == "Rot" else cv2.Rodrigues(matrix)[0]
        outer.write(f"{rotation}_{name}", rotation_vector)
        outer.write(f"T_{name}", (-matrix @ shot.center).reshape(3, 1))
    inner.release()
    outer.release()


def write_panoptic_calibration(traced_capture, folder):
    cameras = [
        {
            "name": f"00_{index:02}",
            "type": "hd",
            "resolution": [shot.width, shot.height],
            "panel": 0,
            "node": index,
            "K": opencv_matrix(shot).tolist(),
            "distCoef": [0, 0, 0, 0, 0],
            "R": shot.axes.T.tolist(),
            "t": (-shot.axes.T @ shot.center).reshape(3, 1).tolist(),
        }
        for index, shot in enumerate(traced_capture.shots)
    ]
    others = [{**cameras[0], "name": "01_01", "type": "vga"}, {**cameras[0], "name": "00_30"}]
    document = {"calibDataSource": "traced", "cameras": [*others, *cameras]}
    (folder / "calibration_room.json").write_text(json.dumps(document))


def opencv_matrix(shot):
    """Return the matrix of a camera whose pixel centers are at whole numbers."""
    return np.array([[shot.fx, 0, shot.cx - 0.5], [0, shot.fy, shot.cy - 0.5], [0, 0, 1]])
