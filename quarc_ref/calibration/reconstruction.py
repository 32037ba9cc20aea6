"""Refines a reconstruction by bundle adjustment, and removes outliers and weak cameras."""

import copy

import numpy as np
import pycolmap

from quarc_ref.calibration.lenses import AUTO_MODEL, FIRST_MODEL, PLAIN_MODEL, LensOptions

MIN_POINTS = 15  # minimum number of points of a camera that two other cameras see
_ROUNDS = 2
_ITERATIONS = 40
_LOSS_SCALE = 0.5  # pixels: scale of the Cauchy loss
_MAX_ERROR = 2.0  # pixels: larger errors come from wrong matches or moving points
_MIN_ANGLE = 1.5  # degrees: minimum angle between the rays to a point
_AS_GOOD = 1.02  # ratio of errors up to which the simpler lens is preferred


def adjust(model: pycolmap.Reconstruction, lenses: LensOptions) -> pycolmap.Reconstruction:
    """Return a reconstruction with optimized poses, lenses and points, without outliers.

    With `auto`, lenses become pinholes if these fit equally well, because undistortion
    resamples the pictures, which costs sharpness.

    Args:
        model: Reconstruction by the mapper; modified in place.
        lenses: Assumptions about the lenses.
    """
    _adjust(model, lenses)
    if lenses.known is not None or lenses.model != AUTO_MODEL:
        return model
    plain = copy.deepcopy(model)
    for camera in plain.cameras.values():
        _remove_distortion(camera)
    _adjust(plain, lenses)
    is_as_good = _error(plain) <= _AS_GOOD * _error(model)
    return plain if is_as_good and _count(plain) * _AS_GOOD >= _count(model) else model


def measure_support(model: pycolmap.Reconstruction) -> dict[int, int]:
    """Return the number of points per image id that two other images see as well."""
    support = {index: 0 for index, image in model.images.items() if image.has_pose}
    for point in model.points3D.values():
        images = {element.image_id for element in point.track.elements}
        if len(images) > 2:
            for index in images:
                support[index] += 1
    return support


def remove_weak(model: pycolmap.Reconstruction) -> dict[int, int]:
    """Remove the poses of images with too few supported points; return their support by id.

    Images are removed one at a time, because each removal reduces the support of points.
    """
    removed: dict[int, int] = {}
    while True:
        support = measure_support(model)
        weak = [index for index, count in support.items() if count < MIN_POINTS]
        if not weak or len(support) <= 2:
            return removed
        weakest = min(weak, key=lambda index: (support[index], index))
        removed[weakest] = support[weakest]
        model.deregister_frame(model.images[weakest].frame_id)


def measure_errors(model: pycolmap.Reconstruction) -> dict[int, list[float]]:
    """Return the reprojection errors in pixels of each image's points, by image id."""
    errors: dict[int, list[float]] = {}
    for index, image in model.images.items():
        if image.has_pose:
            errors[index] = [
                float(np.linalg.norm(image.project_point(position) - point.xy))
                for point, position in _count_observations(model, image)
            ]
    return errors


def _count_observations(
    model: pycolmap.Reconstruction, image: pycolmap.Image
) -> list[tuple[pycolmap.Point2D, np.ndarray]]:
    seen = [point for point in image.points2D if point.has_point3D()]
    found = [(point, model.points3D[point.point3D_id].xyz) for point in seen]
    return [(point, xyz) for point, xyz in found if image.project_point(xyz) is not None]


def _adjust(model: pycolmap.Reconstruction, lenses: LensOptions) -> None:
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_focal_length = options.refine_extra_params = lenses.known is None
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = _LOSS_SCALE
    options.ceres.solver_options.max_num_iterations = _ITERATIONS
    config = pycolmap.BundleAdjustmentConfig()
    for index in model.reg_image_ids():
        config.add_image(index)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    for _ in range(_ROUNDS):
        # `pycolmap.bundle_adjustment` does the same, but enables COLMAP's log.
        pycolmap.create_default_bundle_adjuster(options, config, model).solve()
        pycolmap.ObservationManager(model).filter_all_points3D(_MAX_ERROR, _MIN_ANGLE)
    model.update_point_3d_errors()


def _remove_distortion(camera: pycolmap.Camera) -> None:
    if camera.model.name != FIRST_MODEL:
        return
    focal, cx, cy = camera.params[:3]
    camera.model = getattr(pycolmap.CameraModelId, PLAIN_MODEL)
    camera.params = [focal, cx, cy]


def _error(model: pycolmap.Reconstruction) -> float:
    return float(model.compute_mean_reprojection_error())


def _count(model: pycolmap.Reconstruction) -> int:
    return int(model.compute_num_observations())
