"""Refines a reconstruction by bundle adjustment; removes outliers and poorly supported cameras."""

import copy

import numpy as np

from quarc_ref.calibration.lenses import AUTO_MODEL, INITIAL_AUTO_MODEL, PINHOLE_MODEL, LensOptions
from quarc_ref.datasets.colmap_import import pycolmap

# Minimum number per camera; a point is supported if at least two other cameras see it.
MIN_SUPPORTED_POINTS = 15
_ADJUSTMENT_ROUNDS = 2
_MAX_ITERATIONS = 40
_LOSS_SCALE = 0.5  # pixels: scale of the Cauchy loss
_MAX_ERROR = 2.0  # pixels: larger errors come from wrong matches or moving points
_MIN_ANGLE = 1.5  # degrees: minimum angle between the rays to a point
_MAX_ERROR_RATIO = 1.02  # maximum ratio of a pinhole's error to that of a distorted lens


def refine_reconstruction(
    model: pycolmap.Reconstruction, lenses: LensOptions
) -> pycolmap.Reconstruction:
    """Optimize the poses, lenses and points of a reconstruction, and remove outliers.

    With the model `auto`, lenses become pinholes if pinholes fit equally well. Pictures with
    distortion would have to be resampled, which reduces sharpness.

    Args:
        model: Reconstruction from the mapper; modified in place.
        lenses: Assumptions about the lenses.
    """
    _bundle_adjust(model, lenses)
    if lenses.known_lenses is not None or lenses.model != AUTO_MODEL:
        return model
    pinhole_model = copy.deepcopy(model)
    for camera in pinhole_model.cameras.values():
        _remove_distortion(camera)
    _bundle_adjust(pinhole_model, lenses)
    max_error = _MAX_ERROR_RATIO * _compute_mean_error(model)
    is_as_accurate = _compute_mean_error(pinhole_model) <= max_error
    return (
        pinhole_model
        if is_as_accurate
        and _count_observations(pinhole_model) * _MAX_ERROR_RATIO >= _count_observations(model)
        else model
    )


def count_supported_points(model: pycolmap.Reconstruction) -> dict[int, int]:
    """Return, by image id, the number of points that at least two other images also see."""
    support = {image_id: 0 for image_id, image in model.images.items() if image.has_pose}
    for point in model.points3D.values():
        image_ids = {element.image_id for element in point.track.elements}
        if len(image_ids) > 2:
            for image_id in image_ids:
                support[image_id] += 1
    return support


def remove_unsupported_images(model: pycolmap.Reconstruction) -> dict[int, int]:
    """Remove the poses of images with too few supported points; return their point counts by id.

    Images are removed one at a time, because each removal leaves other images with fewer supported
    points.
    """
    removed_counts: dict[int, int] = {}
    while True:
        support = count_supported_points(model)
        unsupported_ids = [
            image_id for image_id, count in support.items() if count < MIN_SUPPORTED_POINTS
        ]
        if not unsupported_ids or len(support) <= 2:
            return removed_counts
        weakest_id = min(unsupported_ids, key=lambda image_id: (support[image_id], image_id))
        removed_counts[weakest_id] = support[weakest_id]
        model.deregister_frame(model.images[weakest_id].frame_id)


def measure_errors(model: pycolmap.Reconstruction) -> dict[int, list[float]]:
    """Return the reprojection errors of all points of each image, in pixels, by image id."""
    errors: dict[int, list[float]] = {}
    for image_id, image in model.images.items():
        if image.has_pose:
            errors[image_id] = [
                float(np.linalg.norm(image.project_point(position) - point.xy))
                for point, position in _list_observations(model, image)
            ]
    return errors


def _list_observations(
    model: pycolmap.Reconstruction, image: pycolmap.Image
) -> list[tuple[pycolmap.Point2D, np.ndarray]]:
    points = [point for point in image.points2D if point.has_point3D()]
    observations = [(point, model.points3D[point.point3D_id].xyz) for point in points]
    return [(point, xyz) for point, xyz in observations if image.project_point(xyz) is not None]


def _bundle_adjust(model: pycolmap.Reconstruction, lenses: LensOptions) -> None:
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_focal_length = options.refine_extra_params = lenses.known_lenses is None
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = _LOSS_SCALE
    options.ceres.solver_options.max_num_iterations = _MAX_ITERATIONS
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in model.reg_image_ids():
        config.add_image(image_id)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    for _ in range(_ADJUSTMENT_ROUNDS):
        # `pycolmap.bundle_adjustment` does the same, but enables COLMAP's log.
        pycolmap.create_default_bundle_adjuster(options, config, model).solve()
        pycolmap.ObservationManager(model).filter_all_points3D(_MAX_ERROR, _MIN_ANGLE)
    model.update_point_3d_errors()


def _remove_distortion(camera: pycolmap.Camera) -> None:
    if camera.model.name != INITIAL_AUTO_MODEL:
        return
    focal, cx, cy = camera.params[:3]
    camera.model = getattr(pycolmap.CameraModelId, PINHOLE_MODEL)
    camera.params = [focal, cx, cy]


def _compute_mean_error(model: pycolmap.Reconstruction) -> float:
    return float(model.compute_mean_reprojection_error())


def _count_observations(model: pycolmap.Reconstruction) -> int:
    return int(model.compute_num_observations())
