"""Builds a COLMAP database with one picture per camera, from features of several moments.

Geometric verification removes matches that do not fit the estimated geometry of two cameras.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from quarc_ref.calibration.features import Features
from quarc_ref.calibration.fusion import Indices, fuse_keypoints, keep_one_to_one
from quarc_ref.calibration.lenses import AUTO_MODEL, INITIAL_AUTO_MODEL, LensOptions
from quarc_ref.datasets.colmap_cameras import make_colmap_camera
from quarc_ref.datasets.colmap_import import pycolmap
from quarc_ref.datasets.pictures import Size

MIN_MATCHES = 15  # minimum number of verified matches between two cameras
SEED = 0
_INITIAL_FOCAL_RATIO = 1.2  # relative to the longer side of a picture, as in COLMAP


@dataclass(frozen=True, slots=True, eq=False)
class MatchGraph:
    """Cameras and the verified matches between them.

    Attributes:
        database: Path of the COLMAP database; camera `i` has image id `i + 1`.
        names: Names of the cameras.
        feature_counts: Number of features of each camera.
        match_counts: Number of verified matches by pair of camera indices, the smaller index first.
    """

    database: Path
    names: tuple[str, ...]
    feature_counts: tuple[int, ...]
    match_counts: dict[tuple[int, int], int]

    def neighbors(self, camera: int) -> list[tuple[int, str]]:
        """Return the match count and name of each matching camera, most matches first."""
        counts = [
            (count, self.names[second if first == camera else first])
            for (first, second), count in self.match_counts.items()
            if camera in (first, second)
        ]
        return sorted(counts, key=lambda neighbor: (-neighbor[0], neighbor[1]))


def build_match_graph(
    features: Features, names: Sequence[str], sizes: Sequence[Size], lenses: LensOptions
) -> MatchGraph:
    """Build the match graph from the features of all moments.

    Args:
        features: Features of the pictures.
        names: Names of the cameras.
        sizes: Width and height of the pictures of each camera.
        lenses: Assumptions about the lenses.
    """
    database = features.folder / f"graph_{len(features.moments)}.db"
    with pycolmap.Database.open(database) as open_database:
        _write_cameras(open_database, names, sizes, lenses)
        merged_indices: list[list[Indices]] = []
        feature_counts = []
        for index in range(len(names)):
            keypoints, camera_indices = fuse_keypoints(features.read_keypoints(index))
            open_database.write_keypoints(index + 1, keypoints)
            merged_indices.append(camera_indices)
            feature_counts.append(len(keypoints))
        for first, second in combinations(range(len(names)), 2):
            pairs = _fuse_matches(features, first, second, merged_indices)
            if len(pairs):
                open_database.write_matches(first + 1, second + 1, pairs.astype(np.uint32))
    return MatchGraph(database, tuple(names), tuple(feature_counts), _verify_matches(database))


def _fuse_matches(
    features: Features, first: int, second: int, merged_indices: Sequence[Sequence[Indices]]
) -> Indices:
    fused_pairs = [
        np.stack([first_indices[matches[:, 0]], second_indices[matches[:, 1]]], axis=1)
        for matches, first_indices, second_indices in zip(
            features.read_matches(first, second),
            merged_indices[first],
            merged_indices[second],
            strict=True,
        )
    ]
    return keep_one_to_one(np.concatenate(fused_pairs))


def _verify_matches(database: Path) -> dict[tuple[int, int], int]:
    """Verify the matches in a database; return the number of verified matches of each pair."""
    verifier_options = pycolmap.GeometricVerifierOptions()
    # With several threads, random draws would depend on the scheduling of the threads.
    verifier_options.num_threads = 1
    options = pycolmap.TwoViewGeometryOptions()
    options.min_num_inliers = MIN_MATCHES
    options.ransac.random_seed = SEED
    pycolmap.set_random_seed(SEED)
    pycolmap.geometric_verification(
        database, verifier_options=verifier_options, two_view_geometry_options=options
    )
    with pycolmap.Database.open(database) as open_database:
        pair_ids, geometries = open_database.read_two_view_geometries()
    counts = {}
    for pair_id, geometry in zip(pair_ids, geometries, strict=True):
        first, second = sorted(pycolmap.pair_id_to_image_pair(pair_id))
        if len(geometry.inlier_matches) >= MIN_MATCHES:
            counts[first - 1, second - 1] = len(geometry.inlier_matches)
    return counts


def _write_cameras(
    open_database: pycolmap.Database,
    names: Sequence[str],
    sizes: Sequence[Size],
    lenses: LensOptions,
) -> None:
    """Write a COLMAP camera and rig for each lens, and an image for each camera of the rig."""
    lens_ids: dict[object, int] = {}
    for image_id, (name, size) in enumerate(zip(names, sizes, strict=True), start=1):
        lens_key = size if lenses.is_shared and lenses.known_lenses is None else image_id
        if lens_key not in lens_ids:
            lens_ids[lens_key] = image_id
            _write_lens(open_database, image_id, _make_camera(image_id, name, size, lenses))
        sensor = pycolmap.sensor_t(pycolmap.SensorType.CAMERA, lens_ids[lens_key])
        image = pycolmap.Image(name=f"{name}.png", camera_id=lens_ids[lens_key], image_id=image_id)
        open_database.write_image(image, use_image_id=True)
        frame = pycolmap.Frame()
        frame.frame_id, frame.rig_id = image_id, lens_ids[lens_key]
        frame.add_data_id(pycolmap.data_t(sensor, image_id))
        open_database.write_frame(frame, use_frame_id=True)


def _write_lens(open_database: pycolmap.Database, lens_id: int, camera: pycolmap.Camera) -> None:
    open_database.write_camera(camera, use_camera_id=True)
    rig = pycolmap.Rig(rig_id=lens_id)
    rig.add_ref_sensor(pycolmap.sensor_t(pycolmap.SensorType.CAMERA, lens_id))
    open_database.write_rig(rig, use_rig_id=True)


def _make_camera(lens_id: int, name: str, size: Size, lenses: LensOptions) -> pycolmap.Camera:
    if lenses.known_lenses is not None:
        camera = make_colmap_camera(lenses.known_lenses[name], lens_id)
        camera.has_prior_focal_length = True
        return camera
    model = INITIAL_AUTO_MODEL if lenses.model == AUTO_MODEL else lenses.model
    return pycolmap.Camera.create_from_model_name(
        lens_id, model, _INITIAL_FOCAL_RATIO * max(size), size[0], size[1]
    )
