"""Estimates camera poses and lenses from matches, using COLMAP's incremental mapper.

A camera gets a pose only if it sees enough points that at least two other cameras also see. A
pose that depends on matches with only one other camera may be wrong.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.lenses import LensOptions
from quarc_ref.calibration.match_graph import MIN_MATCHES, SEED, MatchGraph
from quarc_ref.calibration.reconstruction import (
    MIN_SUPPORTED_POINTS,
    count_supported_points,
    measure_errors,
    refine_reconstruction,
    remove_unsupported_images,
)
from quarc_ref.calibration.recordings import MIN_CAMERAS
from quarc_ref.datasets.calibration import CalibratedCamera, make_pose
from quarc_ref.datasets.colmap_cameras import make_lens, silence_colmap
from quarc_ref.datasets.colmap_import import pycolmap
from quarc_ref.wording import format_count

_FEW_FEATURES = 100  # below this, the advice after a failure is about the pictures
# Minimum number and share of inliers for the mapper; the strict pair is tried first. A camera that
# passes only with a wrong pose is removed later, because its points lack support.
_INLIER_MINIMUMS = ((30, 0.25), (15, 0.15))


@dataclass(frozen=True, slots=True)
class CameraFit:
    """Quality of the pose of a camera.

    Attributes:
        point_count: Number of points that the camera sees.
        support: Number of these points that at least two other cameras see as well.
        mean_error: Mean reprojection error, pixels.
        median_error: Median reprojection error, pixels.
    """

    point_count: int
    support: int
    mean_error: float
    median_error: float


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """Estimated poses and lenses.

    Attributes:
        cameras: Cameras with poses in the solver's world, in the order of the recordings.
        fits: Quality of the poses, by camera name.
        left_out: Reasons why cameras have no pose, by camera name.
        points: `[P, 3]` positions of points triangulated from the matches of all moments.
    """

    cameras: tuple[CalibratedCamera, ...]
    fits: dict[str, CameraFit]
    left_out: dict[str, str]
    points: NDArray[np.float64]

    def without_cameras(self, reasons: dict[str, str]) -> "Solution":
        """Return the solution without the given cameras.

        Args:
            reasons: Names of the cameras to leave out, with the reason for each camera.
        """
        return Solution(
            tuple(camera for camera in self.cameras if camera.name not in reasons),
            {name: fit for name, fit in self.fits.items() if name not in reasons},
            self.left_out | reasons,
            self.points,
        )

    @property
    def mean_error(self) -> float:
        """Mean reprojection error of all points in all cameras, pixels."""
        weights = [fit.point_count for fit in self.fits.values()]
        errors = [fit.mean_error for fit in self.fits.values()]
        return float(np.average(errors, weights=weights))


def solve_match_graph(graph: MatchGraph, lenses: LensOptions) -> Solution:
    """Estimate the poses and lenses of as many cameras as possible.

    Args:
        graph: Graph of verified matches.
        lenses: Assumptions about the lenses.

    Raises:
        CalibrationError: Fewer than three cameras get a pose; the message says why.
    """
    best_result: tuple[pycolmap.Reconstruction, dict[int, int]] | None = None
    with silence_colmap():
        for inlier_minimums in _INLIER_MINIMUMS:
            model = _run_mapper(graph, lenses, *inlier_minimums)
            if model is None:
                continue
            model = refine_reconstruction(model, lenses)
            removed_counts = remove_unsupported_images(model)
            if best_result is None or model.num_reg_images() > best_result[0].num_reg_images():
                best_result = model, removed_counts
            if best_result[0].num_reg_images() == len(graph.names):
                break
    if best_result is None or best_result[0].num_reg_images() < MIN_CAMERAS:
        reasons = [
            f"{name}: {_explain_failure(graph, i, None)}" for i, name in enumerate(graph.names)
        ]
        message = (
            "fewer than three cameras could be calibrated. Check that the cameras are in focus and "
            f"near each other, and that they show the same textured scene. {'; '.join(reasons)}"
        )
        raise CalibrationError(message)
    return _make_solution(graph, *best_result)


def _run_mapper(
    graph: MatchGraph, lenses: LensOptions, min_inliers: int, min_inlier_share: float
) -> pycolmap.Reconstruction | None:
    """Run the mapper, and return its largest reconstruction; return None if it fails."""
    options = pycolmap.IncrementalPipelineOptions()
    options.min_num_matches = MIN_MATCHES
    options.min_model_size = MIN_CAMERAS
    options.extract_colors = False
    options.random_seed = SEED
    options.mapper.random_seed = SEED
    options.triangulation.random_seed = SEED
    options.mapper.abs_pose_min_num_inliers = min_inliers
    options.mapper.abs_pose_min_inlier_ratio = min_inlier_share
    if lenses.known_lenses is not None:
        options.ba_refine_focal_length = options.ba_refine_extra_params = False
        options.mapper.abs_pose_refine_focal_length = False
        options.mapper.abs_pose_refine_extra_params = False
    output_folder = Path(graph.database.parent) / f"{graph.database.stem}_{min_inliers}"
    output_folder.mkdir(exist_ok=True)
    pycolmap.set_random_seed(SEED)
    models = pycolmap.incremental_mapping(
        graph.database, graph.database.parent, output_folder, options
    )
    return max(models.values(), key=lambda model: model.num_reg_images(), default=None)


def _make_solution(
    graph: MatchGraph, model: pycolmap.Reconstruction, removed_counts: dict[int, int]
) -> Solution:
    errors, support = measure_errors(model), count_supported_points(model)
    image_ids = sorted(errors)
    cameras = [_make_camera(graph.names[image_id - 1], model, image_id) for image_id in image_ids]
    return Solution(
        tuple(cameras),
        {
            graph.names[image_id - 1]: CameraFit(
                len(errors[image_id]),
                support[image_id],
                fmean(errors[image_id]),
                median(errors[image_id]),
            )
            for image_id in image_ids
        },
        {
            name: _explain_failure(graph, index, removed_counts.get(index + 1))
            for index, name in enumerate(graph.names)
            if index + 1 not in errors
        },
        np.array([point.xyz for point in model.points3D.values()]).reshape(-1, 3),
    )


def _make_camera(name: str, model: pycolmap.Reconstruction, image_id: int) -> CalibratedCamera:
    image = model.images[image_id]
    camera_from_world = image.cam_from_world()
    axes = camera_from_world.rotation.matrix().T
    pose = make_pose(axes, -axes @ camera_from_world.translation)
    return CalibratedCamera(name, make_lens(name, model.cameras[image.camera_id]), pose)


def _explain_failure(graph: MatchGraph, camera: int, support: int | None) -> str:
    """Return the reason why a camera has no pose, with advice."""
    count, neighbors = graph.feature_counts[camera], graph.neighbors(camera)
    if support is not None:
        return (
            f"only {support} of its points are seen by at least two other cameras, but a reliable "
            f"pose needs {MIN_SUPPORTED_POINTS} such points"
        )
    if count < _FEW_FEATURES:
        return (
            f"its pictures have only {format_count(count, 'feature')}: check whether they are "
            "dark, blurred or empty"
        )
    if not neighbors:
        return (
            f"it has fewer than {MIN_MATCHES} matches with every other camera: it may show "
            "another scene, or be too far from the others"
        )
    return (
        f"no pose fits its matches with {_list_neighbors(neighbors)}: use more pictures "
        "(--moments 16), or add a camera between this camera and the others"
    )


def _list_neighbors(neighbors: Sequence[tuple[int, str]]) -> str:
    shown_names = ", ".join(f"{name} ({count})" for count, name in neighbors[:3])
    hidden_count = len(neighbors) - 3
    return f"{shown_names} and {hidden_count} more" if hidden_count > 0 else shown_names
