from dataclasses import replace

import numpy as np
import pytest
import torch

from quarc_ref.encoder.training.measurements import measure_error
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.rendering.pictures import render_picture
from tests.encoder.masked_toys import BORDER, ColumnMasks, add_masks
from tests.encoder.toys import make_capture, make_context, make_splats


def test_the_error_is_the_root_mean_square_over_all_pixels_after_exposure_correction():
    context = make_context()
    context.exposures.gains = torch.tensor([[0.9], [1.0], [1.1]]).repeat(1, 3)
    splats = make_splats(2)  # not the scene of frame 0

    error = measure_error(context, from_splats(splats, context.device), fits_exposures=False)

    differences = [
        render_picture(splats, context.camera(view)) - context.views.picture(view, 0).numpy() / gain
        for view, gain in enumerate((0.9, 1.0, 1.1))
    ]
    assert error == pytest.approx(np.sqrt(np.mean(np.square(differences))), rel=1e-4)
    assert error > 0.01


def test_masked_pixels_do_not_count():
    splats = make_splats(2)

    error = _measure_masked_error(splats, ColumnMasks())

    views = make_context().views
    differences = [
        (render_picture(splats, camera) - views.picture(view, 0).numpy())[:, :BORDER]
        for view, camera in enumerate(views.cameras)
    ]
    assert error == pytest.approx(np.sqrt(np.mean(np.square(differences))), rel=1e-4)
    assert _measure_masked_error(splats, ColumnMasks(border=0)) == 0


def _measure_masked_error(splats, masks):
    context = make_context()
    views = TrainingViews(add_masks(make_capture(), masks=masks), context.device)
    attributes = from_splats(splats, context.device)
    return measure_error(replace(context, views=views), attributes, fits_exposures=False)


def test_exposures_that_are_fitted_first_do_not_contribute_to_the_error():
    attributes = from_splats(make_splats(0), torch.device("cpu"))
    wrong_gains = torch.tensor([[0.7], [1.0], [1.3]]).repeat(1, 3)

    errors = []
    for fits_exposures in (False, True):
        context = make_context()
        context.exposures.gains = wrong_gains
        errors.append(measure_error(context, attributes, fits_exposures=fits_exposures))

    assert errors[1] < 0.01 < 0.1 < errors[0]
