"""Triangulates initial points for captures that have none.

pycolmap detects SIFT features in frame 0 of every camera, matches all pairs of cameras, and
verifies the matches with the known poses. pycolmap then triangulates points without changing the
poses and lenses. The points determine the range of depths that `dense_points` searches. All seeds
are fixed, so the result is deterministic. Only the features are detected in several threads: when
the other steps had several threads, too, they once found other points.
"""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from quarc_ref.datasets.calibration import CalibratedCamera
from quarc_ref.datasets.capture import Image, Points
from quarc_ref.datasets.colmap_cameras import make_colmap_camera, silence_colmap
from quarc_ref.datasets.colmap_import import pycolmap
from quarc_ref.datasets.dense_points import add_dense_points
from quarc_ref.datasets.errors import UnreadablePointsError

_MIN_POINTS = 100
_MIN_MATCHES = 10  # Minimum number of matches between two cameras.
_MAX_EPIPOLAR_DISTANCE = 2.0  # Pixels; maximum distance of a match from its epipolar line.
_MAX_MATCH_RATIO = 0.9
_SEED = 0
_REMEDY = (
    "provide points3D_init.ply (N3DV), ply_file_path (nerfstudio), or points in the model (COLMAP)"
)


def triangulate(cameras: Sequence[CalibratedCamera], pictures: Sequence[Image]) -> Points:
    """Triangulate scene points from one picture per camera, and add dense points.

    Args:
        cameras: Pinhole cameras.
        pictures: `[camera]` pictures, each `[H, W, 3]` sRGB.

    Raises:
        UnreadablePointsError: There is only one camera, or too few points are found.
    """
    if len(cameras) == 1:
        message = (
            "the initial points cannot be triangulated from one training camera: hold out fewer "
            f"cameras, add cameras, or {_REMEDY}"
        )
        raise UnreadablePointsError(message)
    with tempfile.TemporaryDirectory() as name, silence_colmap():
        folder = Path(name)
        try:
            points = _triangulate_sparse_points(cameras, pictures, folder)
        except (RuntimeError, ValueError) as error:
            message = f"the initial points cannot be triangulated: {error}; {_REMEDY}"
            raise UnreadablePointsError(message) from error
    if len(points) < _MIN_POINTS:
        message = (
            f"only {len(points)} initial points could be triangulated from frame 0: check that the "
            f"poses and the pictures match, or {_REMEDY}"
        )
        raise UnreadablePointsError(message)
    positions = np.array([point.xyz for point in points], dtype=np.float32)
    colors = np.array([point.color for point in points], dtype=np.uint8)
    return add_dense_points(cameras, pictures, Points(positions, colors))


def _triangulate_sparse_points(
    cameras: Sequence[CalibratedCamera], pictures: Sequence[Image], folder: Path
) -> "list[pycolmap.Point3D]":
    """Triangulate points; `folder` is an empty folder for temporary files."""
    database = folder / "database.db"
    model = _make_posed_model(cameras, database)
    for index, picture in enumerate(pictures, start=1):
        pycolmap.Bitmap.from_array(picture).write(folder / _make_file_name(index))
    pycolmap.extract_features(database, folder, device=pycolmap.Device.cpu)
    _match_features(model, database)
    options = pycolmap.IncrementalPipelineOptions()
    options.min_num_matches = _MIN_MATCHES
    options.num_threads = 1
    options.random_seed = _SEED
    options.mapper.random_seed = _SEED
    options.triangulation.random_seed = _SEED
    options.triangulation.ignore_two_view_tracks = False
    model = pycolmap.triangulate_points(model, database, folder, folder, options=options)
    return [model.points3D[index] for index in sorted(model.points3D)]


def _match_features(model: "pycolmap.Reconstruction", database: Path) -> None:
    """Match the features of all pairs of images, and keep the matches that fit the poses."""
    matching_options = pycolmap.FeatureMatchingOptions()
    matching_options.num_threads = 1
    matching_options.skip_geometric_verification = True
    # The ratio test is lenient, because the epipolar check removes most wrong matches.
    matching_options.sift.max_ratio = _MAX_MATCH_RATIO
    verification_options = pycolmap.TwoViewGeometryOptions()
    verification_options.min_num_inliers = _MIN_MATCHES
    verification_options.ransac.max_error = _MAX_EPIPOLAR_DISTANCE
    verification_options.ransac.random_seed = _SEED
    pycolmap.match_exhaustive(database, matching_options, device=pycolmap.Device.cpu)
    pycolmap.guided_geometric_verification(
        model, database, two_view_geometry_options=verification_options, num_threads=1
    )


def _make_posed_model(
    cameras: Sequence[CalibratedCamera], database: Path
) -> "pycolmap.Reconstruction":
    """Make a model with the known poses and no points, and add its images to a database."""
    model = pycolmap.Reconstruction()
    with pycolmap.Database.open(database) as open_database:
        for index, camera in enumerate(cameras, start=1):
            pose = pycolmap.Rigid3d(
                pycolmap.Rotation3d(camera.pose.rotation), camera.pose.translation
            )
            model.add_camera_with_trivial_rig(make_colmap_camera(camera.lens, index))
            image = pycolmap.Image(_make_file_name(index), np.empty((0, 2)), index, index)
            model.add_image_with_trivial_frame(image, pose)
            open_database.write_camera(model.camera(index), use_camera_id=True)
            open_database.write_rig(model.rig(index), use_rig_id=True)
            open_database.write_frame(model.frame(index), use_frame_id=True)
            open_database.write_image(model.image(index), use_image_id=True)
    return model


def _make_file_name(index: int) -> str:
    return f"{index:04d}.png"
