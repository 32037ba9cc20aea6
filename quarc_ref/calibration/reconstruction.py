"""Adjusting a reconstruction: all of pycolmap that is done once cameras have poses."""

import copy

import numpy as np
import pycolmap

from quarc_ref.calibration.lenses import AUTO_MODEL, FIRST_MODEL, PLAIN_MODEL, LensOptions

LEAST_POINTS = 15  # of a camera, each seen by two others at least
_ROUNDS = 2
_ITERATIONS = 40
_LOSS_SCALE = 0.5  # pixels, of the Cauchy loss
_MOST_ERROR = 2.0  # pixels: what is off by more is a wrong match, or has moved
_LEAST_ANGLE = 1.5  # degrees between the rays to a point
_AS_GOOD = 1.02  # ratio of errors within which the simpler lens is taken


def adjust(model: pycolmap.Reconstruction, lenses: LensOptions) -> pycolmap.Reconstruction:
    """Return a reconstruction with optimized poses, lenses and points, without outliers.

    With `auto` lenses are pinholes if these explain the pictures as well: bent pictures must
    be resampled when they are loaded, which costs sharpness.

    Args:
        model: As the mapper has it; it is changed.
        lenses: Assumptions about the lenses.
    """
    _adjust(model, lenses)
    if lenses.known is not None or lenses.model != AUTO_MODEL:
        return model
    plain = copy.deepcopy(model)
    for camera in plain.cameras.values():
        _make_plain(camera)
    _adjust(plain, lenses)
    is_as_good = _error(plain) <= _AS_GOOD * _error(model)
    return plain if is_as_good and _count(plain) * _AS_GOOD >= _count(model) else model


def measure_support(model: pycolmap.Reconstruction) -> dict[int, int]:
    """Return how many points of each image two others see too, by its id."""
    support = {index: 0 for index, image in model.images.items() if image.has_pose}
    for point in model.points3D.values():
        images = {element.image_id for element in point.track.elements}
        if len(images) > 2:
            for index in images:
                support[index] += 1
    return support


def remove_weak(model: pycolmap.Reconstruction) -> dict[int, int]:
    """Take the poses of images that too few points support; return their support, by id.

    One at a time, since points lose support with the images that see them.
    """
    removed: dict[int, int] = {}
    while True:
        support = measure_support(model)
        weak = [index for index, count in support.items() if count < LEAST_POINTS]
        if not weak or len(support) <= 2:
            return removed
        weakest = min(weak, key=lambda index: (support[index], index))
        removed[weakest] = support[weakest]
        model.deregister_frame(model.images[weakest].frame_id)


def measure_errors(model: pycolmap.Reconstruction) -> dict[int, list[float]]:
    """Return the reprojection errors of each image's points, pixels, by the id of the image."""
    errors: dict[int, list[float]] = {}
    for index, image in model.images.items():
        if image.has_pose:
            errors[index] = [
                float(np.linalg.norm(image.project_point(position) - point.xy))
                for point, position in _see(model, image)
            ]
    return errors


def _see(
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
        # `pycolmap.bundle_adjustment` does the same, and turns COLMAP's log on.
        pycolmap.create_default_bundle_adjuster(options, config, model).solve()
        pycolmap.ObservationManager(model).filter_all_points3D(_MOST_ERROR, _LEAST_ANGLE)
    model.update_point_3d_errors()


def _make_plain(camera: pycolmap.Camera) -> None:
    if camera.model.name != FIRST_MODEL:
        return
    focal, cx, cy = camera.params[:3]
    camera.model = getattr(pycolmap.CameraModelId, PLAIN_MODEL)
    camera.params = [focal, cx, cy]


def _error(model: pycolmap.Reconstruction) -> float:
    return float(model.compute_mean_reprojection_error())


def _count(model: pycolmap.Reconstruction) -> int:
    return int(model.compute_num_observations())
