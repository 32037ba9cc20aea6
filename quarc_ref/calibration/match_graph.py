"""Builds a COLMAP database with one picture per camera, from features of several moments.

Matches are verified geometrically: those that fit no relative pose of two cameras are dropped.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import pycolmap

from quarc_ref.calibration.features import Features
from quarc_ref.calibration.fusion import Indices, fuse_keypoints, keep_one_to_one
from quarc_ref.calibration.lenses import AUTO_MODEL, FIRST_MODEL, LensOptions
from quarc_ref.datasets.colmap_cameras import make_colmap_camera
from quarc_ref.datasets.pictures import Size

MIN_MATCHES = 15  # minimum number of verified matches between two cameras
SEED = 0
_FOCAL_GUESS = 1.2  # in units of the longer side of a picture, as in COLMAP


@dataclass(frozen=True, slots=True, eq=False)
class MatchGraph:
    """Cameras and the verified matches between them.

    Attributes:
        database: Path of the COLMAP database; camera `i` has image id `i + 1`.
        names: `[camera]` names.
        feature_counts: `[camera]` numbers of features.
        matches: Number of verified matches, by the ascending indices of two cameras.
    """

    database: Path
    names: tuple[str, ...]
    feature_counts: tuple[int, ...]
    matches: dict[tuple[int, int], int]

    def neighbors(self, camera: int) -> list[tuple[int, str]]:
        """Return number of matches and name of each connected camera, in descending order."""
        counts = [
            (count, self.names[second if first == camera else first])
            for (first, second), count in self.matches.items()
            if camera in (first, second)
        ]
        return sorted(counts, key=lambda each: (-each[0], each[1]))


def build_match_graph(
    features: Features, names: Sequence[str], sizes: Sequence[Size], lenses: LensOptions
) -> MatchGraph:
    """Return the graph of all moments that have features.

    Args:
        features: Features of the pictures.
        names: `[camera]` names.
        sizes: `[camera]` width and height of pictures.
        lenses: Assumptions about the lenses.
    """
    database = features.folder / f"graph_{len(features.moments)}.db"
    with pycolmap.Database.open(database) as rows:
        _write_cameras(rows, names, sizes, lenses)
        places: list[list[Indices]] = []
        counts = []
        for index in range(len(names)):
            keypoints, places_of_camera = fuse_keypoints(features.read_keypoints(index))
            rows.write_keypoints(index + 1, keypoints)
            places.append(places_of_camera)
            counts.append(len(keypoints))
        for first, second in combinations(range(len(names)), 2):
            pairs = _fuse_matches(features, first, second, places)
            if len(pairs):
                rows.write_matches(first + 1, second + 1, pairs.astype(np.uint32))
    return MatchGraph(database, tuple(names), tuple(counts), _verify(database))


def _fuse_matches(
    features: Features, first: int, second: int, places: Sequence[Sequence[Indices]]
) -> Indices:
    found = [
        np.stack([left[matches[:, 0]], right[matches[:, 1]]], axis=1)
        for matches, left, right in zip(
            features.read_matches(first, second), places[first], places[second], strict=True
        )
    ]
    return keep_one_to_one(np.concatenate(found))


def _verify(database: Path) -> dict[tuple[int, int], int]:
    """Verify the matches in a database, and return the number of remaining ones per pair."""
    verifier = pycolmap.GeometricVerifierOptions()
    verifier.num_threads = 1  # otherwise random draws would depend on the scheduling of threads
    options = pycolmap.TwoViewGeometryOptions()
    options.min_num_inliers = MIN_MATCHES
    options.ransac.random_seed = SEED
    pycolmap.set_random_seed(SEED)
    pycolmap.geometric_verification(
        database, verifier_options=verifier, two_view_geometry_options=options
    )
    with pycolmap.Database.open(database) as rows:
        pair_ids, geometries = rows.read_two_view_geometries()
    counts = {}
    for pair_id, geometry in zip(pair_ids, geometries, strict=True):
        first, second = sorted(pycolmap.pair_id_to_image_pair(pair_id))
        if len(geometry.inlier_matches) >= MIN_MATCHES:
            counts[first - 1, second - 1] = len(geometry.inlier_matches)
    return counts


def _write_cameras(
    rows: pycolmap.Database, names: Sequence[str], sizes: Sequence[Size], lenses: LensOptions
) -> None:
    """Write lenses, each with its own rig, and one image per camera of the capture."""
    written: dict[object, int] = {}
    for index, (name, size) in enumerate(zip(names, sizes, strict=True), start=1):
        key = size if lenses.shared and lenses.known is None else index
        if key not in written:
            written[key] = index
            _write_lens(rows, index, _make_camera(index, name, size, lenses))
        sensor = pycolmap.sensor_t(pycolmap.SensorType.CAMERA, written[key])
        image = pycolmap.Image(name=f"{name}.png", camera_id=written[key], image_id=index)
        rows.write_image(image, use_image_id=True)
        frame = pycolmap.Frame()
        frame.frame_id, frame.rig_id = index, written[key]
        frame.add_data_id(pycolmap.data_t(sensor, index))
        rows.write_frame(frame, use_frame_id=True)


def _write_lens(rows: pycolmap.Database, index: int, camera: pycolmap.Camera) -> None:
    rows.write_camera(camera, use_camera_id=True)
    rig = pycolmap.Rig(rig_id=index)
    rig.add_ref_sensor(pycolmap.sensor_t(pycolmap.SensorType.CAMERA, index))
    rows.write_rig(rig, use_rig_id=True)


def _make_camera(index: int, name: str, size: Size, lenses: LensOptions) -> pycolmap.Camera:
    if lenses.known is not None:
        camera = make_colmap_camera(lenses.known[name], index)
        camera.has_prior_focal_length = True
        return camera
    model = FIRST_MODEL if lenses.model == AUTO_MODEL else lenses.model
    return pycolmap.Camera.create_from_model_name(
        index, model, _FOCAL_GUESS * max(size), size[0], size[1]
    )
