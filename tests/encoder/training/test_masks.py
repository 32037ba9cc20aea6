"""Masked pixels have no influence on training and evaluation."""

from dataclasses import replace
from io import BytesIO

import pytest
import torch

from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.monitoring.monitor import TrainingStep
from quarc_ref.encoder.settings.config import StepSettings
from quarc_ref.encoder.training.views import TrainingViews
from quarc_ref.evaluation.camera_group import CameraGroup
from quarc_ref.streams import decode
from tests.encoder.masked_toys import BORDER, ColumnMasks, NoisySource, add_masks
from tests.encoder.toys import HEIGHT, SMALL, WIDTH, make_capture, make_context

FRAMES = 2


def _encode(capture, config=SMALL):
    sink = BytesIO()
    encode(capture, sink, EncodeOptions(config, FRAMES, "cpu", checks=False))
    return sink.getvalue()


FULL_CONFIG = replace(
    SMALL,
    steps=StepSettings(position_pixels=0.2, translation_change=0.004, translation_error=0.25),
    canonical=replace(SMALL.canonical, exposure_lr=0.2, exposure_from_iter=10, prune_rd_lambda=0.2),
    births=replace(SMALL.births, placement="errors", error_threshold=0.02, rd_selection=True),
)  # enables all parts of the encoder that use pictures


@pytest.fixture(scope="module")
def clean_capture():
    return make_capture(FRAMES)


@pytest.fixture(scope="module")
def unmasked_stream(clean_capture):
    return _encode(clean_capture, FULL_CONFIG)


@pytest.fixture(scope="module")
def noisy_stream(clean_capture):
    return _encode(add_masks(clean_capture, NoisySource(clean_capture)), FULL_CONFIG)


def test_masked_pixels_change_no_byte(clean_capture, noisy_stream):
    assert _encode(add_masks(clean_capture), FULL_CONFIG) == noisy_stream


def test_masks_that_keep_everything_change_no_byte(clean_capture, unmasked_stream):
    assert (
        _encode(add_masks(clean_capture, masks=ColumnMasks(WIDTH)), FULL_CONFIG) == unmasked_stream
    )


def test_kept_pixels_are_trained_as_well_as_without_the_fault(
    clean_capture, unmasked_stream, noisy_stream
):
    noisy_capture = add_masks(clean_capture, NoisySource(clean_capture))
    psnr = []
    for stream in (unmasked_stream, noisy_stream):
        group = CameraGroup(noisy_capture, clean_capture.cameras, clean_capture.training)
        for scene in decode(stream):
            group.measure(dequantize(scene), scene.frame)
        psnr.append(group.quality.mean()["psnr"])
    unmasked_psnr, masked_psnr = psnr
    assert masked_psnr > unmasked_psnr - 1.0
    assert masked_psnr > 20


def test_figures_include_only_kept_pixels(unmasked_stream):
    clean_capture = make_capture(3)
    scene = next(iter(decode(unmasked_stream)))
    figures = []
    for capture in (
        add_masks(clean_capture),
        add_masks(clean_capture, NoisySource(clean_capture)),
    ):
        group = CameraGroup(capture, clean_capture.cameras, clean_capture.held_out)
        group.measure(dequantize(scene), 0)
        figures.append(group.quality.mean())
    assert figures[0] == figures[1]


def test_a_mask_is_halved_with_its_picture():
    views = TrainingViews(
        add_masks(make_capture(), masks=ColumnMasks(BORDER - 1)), torch.device("cpu")
    )
    mask, half_mask = views.mask(0, 0), views.halved().mask(0, 0)
    assert mask.shape == (HEIGHT, WIDTH, 1)
    assert mask.sum() == HEIGHT * (BORDER - 1)
    assert half_mask.shape == (HEIGHT // 2, WIDTH // 2, 1)
    assert half_mask.sum() == HEIGHT // 2 * (BORDER // 2 - 1)
    assert (views.halved().picture(0, 0)[:, BORDER // 2 :] == 0).all()


def test_the_gradient_of_masked_pixels_is_zero():
    context = make_context()
    masked_context = replace(
        context, views=TrainingViews(add_masks(make_capture()), context.device)
    )
    image = torch.rand(HEIGHT, WIDTH, 3).requires_grad_()
    masked_context.photometric_loss(image, 0, 0, 0.2).backward()
    assert (image.grad[:, BORDER:] == 0).all()
    assert (image.grad[:, :BORDER] != 0).any()


def test_the_psnr_of_a_step_is_that_of_the_kept_pixels():
    image, truth = torch.zeros(4, 4, 3), torch.full((4, 4, 3), 0.1)
    mask = torch.zeros(4, 4, 1)
    mask[:2] = 1
    truth[2:] = 1.0
    step = TrainingStep("motion", 1, 1, 1, 1, torch.tensor(0.0), image, lambda: truth, mask)
    assert step.psnr() == pytest.approx(20.0, abs=1e-4)
