"""Videos of a traced rig without poses, small enough to calibrate in seconds."""

import shutil

from quarc_ref.datasets.layouts.n3dv import read_n3dv
from quarc_ref.synth import SynthOptions, write_synthetic_capture

OPTIONS = SynthOptions(width=320, height=240, frames=1, cameras=12)


def write_recordings(folder, camera_count=None):
    """Write videos without poses into a folder, and return the cameras that recorded them.

    With a camera count, the folder has only the videos of the first cameras, which are neighbors.
    """
    traced = folder.parent / f"{folder.name}_traced"
    write_synthetic_capture(traced, OPTIONS)
    true_cameras = read_n3dv(traced).cameras
    folder.mkdir()
    for path in sorted(traced.glob("*.mp4"))[:camera_count]:
        shutil.copy(path, folder / path.name)
    return true_cameras[:camera_count]
