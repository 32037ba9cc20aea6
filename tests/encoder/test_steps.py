import io
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.capture import Points
from quarc_ref.encoder import EncodeOptions, encode, encode_stream
from quarc_ref.encoder.adapt_steps import adapt_steps_to_capture, adapt_steps_to_error
from quarc_ref.encoder.segments import slice_capture
from quarc_ref.encoder.settings.config import EncoderConfig, StepSettings
from quarc_ref.encoder.steps import (
    measure_pixel_size,
    measure_sharpness,
    propose_steps,
    replace_translation_step,
)
from quarc_ref.encoder.training.straight_through import position_step, translation_step
from quarc_ref.format import wire
from quarc_ref.format.constants import POSITION_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import LATTICE_STEP_LIMIT, StreamHeader
from quarc_ref.streams.chunk_reader import split_chunks
from tests.encoder.toys import SMALL, make_cameras, make_capture

_SETTINGS = StepSettings(position_pixels=0.25, translation_change=0.004)
_CAMERAS_AND_POINTS = make_cameras(), make_capture().points


def _make_gradient_picture(slope: float, shape: tuple[int, int] = (40, 60)):
    """Return a picture whose brightness increases to the right by `slope` per pixel."""
    row = np.round(np.arange(shape[1]) * slope * 255).astype(np.uint8)
    return np.broadcast_to(row[None, :, None], (*shape, 3))


def _unmasked(*pictures):
    return [(picture, None) for picture in pictures]


_PICTURES = _unmasked(_make_gradient_picture(2 / 255))


def _scale_scene(factor: float):
    """Return the cameras and points of the toy capture in another unit of length."""
    cameras, points = _CAMERAS_AND_POINTS
    cameras = [
        replace(camera, translation=tuple(factor * x for x in camera.translation))
        for camera in cameras
    ]
    return cameras, Points((factor * points.positions).astype(np.float32), points.colors)


def _propose(factor: float = 1.0, settings: StepSettings = _SETTINGS) -> StreamHeader:
    return propose_steps(StreamHeader(), settings, *_scale_scene(factor), _PICTURES)


def test_a_pixel_is_as_wide_as_the_median_depth_over_the_focal_length():
    camera = replace(make_cameras()[0], rotation=(1.0, 0, 0, 0, 1, 0, 0, 0, 1))
    depths = np.array([1.0, 2, 3, -3, 2])
    positions = np.stack([[0, 0, 0, 0, 9], np.zeros(5), depths - 3], axis=1)
    points = Points(positions.astype(np.float32), np.zeros((5, 3), dtype=np.uint8))

    assert measure_pixel_size([camera], points) == pytest.approx(2 / 50)


def test_sharpness_is_the_root_mean_square_change_from_pixel_to_pixel():
    # the picture does not change downward
    changed_fraction = 38 * 57 / (38 * 57 + 37 * 58)
    sharpness = 2 / 255 * changed_fraction**0.5

    assert measure_sharpness(_PICTURES) == pytest.approx(sharpness)
    assert measure_sharpness(
        [*_PICTURES, *_unmasked(_make_gradient_picture(0.0))]
    ) == pytest.approx(sharpness / 2**0.5)


def test_masked_pixels_do_not_count_in_sharpness():
    picture, mask = _make_gradient_picture(2 / 255).copy(), np.ones((40, 60), np.bool_)
    picture[:, 30:] = np.random.default_rng(2).integers(0, 256, (40, 30, 3))
    mask[:, 30:] = False

    cropped = _unmasked(picture[:, :30])
    assert measure_sharpness([(picture, mask)]) == measure_sharpness(cropped)
    assert measure_sharpness([(picture, ~mask)]) > 10 * measure_sharpness(cropped)
    assert measure_sharpness([(picture, np.zeros_like(mask))]) == 0


def test_texture_of_the_background_hardly_changes_sharpness():
    rng = np.random.default_rng(3)
    subject = np.kron(rng.integers(0, 256, (10, 10, 3)), np.ones((4, 4, 1))).astype(np.uint8)
    plain, textured = (np.full((120, 120, 3), 128, np.uint8) for _ in range(2))
    textured += (np.arange(120) // 4 % 2 * 8).astype(np.uint8)[:, None, None]
    for picture in (plain, textured):
        picture[40:80, 40:80] = subject

    assert measure_sharpness(_unmasked(textured)) == pytest.approx(
        measure_sharpness(_unmasked(plain)), rel=0.05
    )


def test_noise_hardly_increases_sharpness():
    rng = np.random.default_rng(1)
    truth = _make_gradient_picture(4 / 255).astype(np.float64)
    noisy = np.clip(np.round(truth + rng.normal(0, 2, truth.shape)), 0, 255).astype(np.uint8)

    unfiltered_sharpness = np.abs(np.diff(noisy.astype(int), axis=0)).mean() / 255
    assert (
        measure_sharpness(_unmasked(noisy))
        - measure_sharpness(_unmasked(_make_gradient_picture(4 / 255)))
        < unfiltered_sharpness / 5
    )


def test_steps_match_the_requested_pixels_and_change_of_pictures():
    pixel = measure_pixel_size(*_CAMERAS_AND_POINTS)
    shift = 0.002 / measure_sharpness(_PICTURES)

    header = _propose(settings=replace(_SETTINGS, translation_change=0.002))

    assert position_step(header) == pytest.approx(0.25 * pixel, rel=1 / 16)
    assert translation_step(header) == pytest.approx(shift * pixel, rel=1 / 16)
    assert 8 <= header.position_step <= 16


def test_a_step_is_at_most_a_pixel_even_without_texture():
    for pictures_without_texture in (
        _unmasked(_make_gradient_picture(0.0)),
        _unmasked(_make_gradient_picture(0.5, (3, 3))),
        [],
    ):
        header = propose_steps(
            StreamHeader(), _SETTINGS, *_CAMERAS_AND_POINTS, pictures_without_texture
        )

        assert translation_step(header) == pytest.approx(
            measure_pixel_size(*_CAMERAS_AND_POINTS), rel=1 / 16
        )


def test_a_capture_in_units_of_an_eighth_differs_only_in_the_lattice_exponent():
    header, scaled_header = _propose(), _propose(8.0)

    assert scaled_header == replace(header, lattice_exponent=header.lattice_exponent - 3)


@given(st.floats(1e-2, 1e3))
def test_steps_in_pixels_do_not_depend_on_the_unit_of_length(factor):
    header, scaled_header = _propose(), _propose(factor)

    assert position_step(scaled_header) == pytest.approx(factor * position_step(header), rel=1 / 7)
    assert translation_step(scaled_header) == pytest.approx(
        factor * translation_step(header), rel=1 / 7
    )


@given(st.floats(1e-4, 1.0))
def test_the_lattice_extends_beyond_the_cameras_and_the_points(pixels):
    cameras, points = _CAMERAS_AND_POINTS
    positions = np.concatenate([points.positions, [[9e3, 0, 0]] * len(points.positions)])
    far_points = Points(positions, np.zeros(positions.shape, dtype=np.uint8))

    header = propose_steps(
        StreamHeader(), StepSettings(pixels, pixels), cameras, far_points, _PICTURES
    )

    assert 4 * 9e3 * 2.0**header.lattice_exponent <= POSITION_LIMIT


@pytest.mark.parametrize("distance", [1e3, 1e6, 3e9])
def test_a_wrong_point_does_not_make_steps_coarser(distance):
    cameras, points = _CAMERAS_AND_POINTS
    positions = np.concatenate([points.positions] * (200 // len(points.positions) + 1))
    usual = Points(positions.copy(), np.zeros(positions.shape, dtype=np.uint8))
    positions[0] = distance
    with_outlier = Points(positions, usual.colors)

    headers = [
        propose_steps(StreamHeader(), _SETTINGS, cameras, given_points, _PICTURES)
        for given_points in (usual, with_outlier)
    ]

    assert headers[0] == headers[1]


def test_without_pixels_the_steps_of_the_stream_are_used():
    assert _propose(settings=StepSettings()) == StreamHeader()


def test_one_step_can_be_in_world_units_and_the_other_in_pixels():
    header = _propose(settings=StepSettings(position_pixels=0.25))

    assert translation_step(header) == pytest.approx(translation_step(StreamHeader()), rel=1 / 16)
    assert position_step(header) == pytest.approx(position_step(_propose()), rel=1 / 16)


@pytest.mark.parametrize(
    ("factor", "position_pixels"),
    [(1e10, 0.25), (1.0, 1e300), (1e10, 1e308), (1e-7, 0.25), (1.0, 1e-30)],
)
def test_steps_that_the_format_does_not_support_are_rejected(factor, position_pixels):
    settings = replace(_SETTINGS, position_pixels=position_pixels)

    with pytest.raises(EncodeError, match="scale the capture"):
        _propose(factor, settings)


def test_points_outside_all_views_give_no_steps():
    cameras, points = _CAMERAS_AND_POINTS
    hidden_points = Points(points.positions + np.float32(1e3), points.colors)

    with pytest.raises(EncodeError, match="no initial point is visible"):
        propose_steps(StreamHeader(), _SETTINGS, cameras, hidden_points, _PICTURES)


def test_the_stream_of_an_encode_has_the_steps_of_its_training_views():
    capture = make_capture()
    training = [capture.cameras[index] for index in capture.training]

    adapted = adapt_steps_to_capture(EncoderConfig(steps=_SETTINGS), capture)

    pictures = _unmasked(*(capture.image(index, 0) for index in capture.training))
    proposed = propose_steps(StreamHeader(), _SETTINGS, training, capture.points, pictures)
    assert adapted.stream == proposed != StreamHeader()


def test_a_segment_of_a_capture_has_the_steps_of_the_whole():
    capture = make_capture()
    config = EncoderConfig(steps=_SETTINGS)

    segment = slice_capture(slice_capture(capture, 1, 2), 1, 1)

    assert (segment.image(1, 0) != capture.image(1, 0)).any()
    assert adapt_steps_to_capture(config, segment) == adapt_steps_to_capture(config, capture)


_ERROR_SETTINGS = replace(_SETTINGS, translation_error=0.25)


def test_the_error_of_frame_0_sets_the_translation_step():
    capture = make_capture()
    config = adapt_steps_to_capture(EncoderConfig(steps=_ERROR_SETTINGS), capture)
    pictures = _unmasked(*(capture.image(index, 0) for index in capture.training))
    sharpness = measure_sharpness(pictures)
    pixel = measure_pixel_size([capture.cameras[i] for i in capture.training], capture.points)

    for error in (0.01, 0.04):
        adapted = adapt_steps_to_error(config, capture, error)

        step = 0.25 * error / sharpness * pixel
        assert translation_step(adapted.stream) == pytest.approx(step, rel=1 / 16)
        assert adapted == replace(
            config,
            stream=replace(config.stream, translation_step=adapted.stream.translation_step),
        )


@pytest.mark.parametrize(
    ("slope", "change", "pixels"),
    [(2 / 255, 0.0, 0.02), (2 / 255, 1e-9, 0.02), (2 / 255, 1e3, 1.0), (0.0, 0.0, 1.0)],
)
def test_the_translation_step_is_from_a_fiftieth_of_a_pixel_to_a_pixel(slope, change, pixels):
    header = _propose(settings=_ERROR_SETTINGS)
    pictures = _unmasked(_make_gradient_picture(slope))

    replaced = replace_translation_step(header, change, *_CAMERAS_AND_POINTS, pictures)

    pixel = measure_pixel_size(*_CAMERAS_AND_POINTS)
    assert translation_step(replaced) == pytest.approx(pixels * pixel, rel=1 / 16)


def test_a_step_for_a_large_error_is_not_above_the_limit_of_the_format():
    cameras_and_points = _scale_scene(factor := 3e6)
    header = _propose(factor, replace(_ERROR_SETTINGS, translation_change=1e-6))
    pixel = measure_pixel_size(*cameras_and_points)

    replaced = replace_translation_step(header, 1.0, *cameras_and_points, _PICTURES)

    assert pixel > LATTICE_STEP_LIMIT > 0.25 * pixel
    assert replaced.translation_step == LATTICE_STEP_LIMIT


def test_plain_areas_do_not_change_the_step_for_an_error():
    rng = np.random.default_rng(3)
    subject = np.kron(rng.integers(0, 256, (10, 10, 3)), np.ones((4, 4, 1))).astype(np.uint8)
    picture, padded_picture = np.zeros((80, 80, 3), np.uint8), np.zeros((160, 160, 3), np.uint8)
    picture[20:60, 20:60] = padded_picture[20:60, 20:60] = subject
    header = _propose(settings=_ERROR_SETTINGS)

    steps = [
        replace_translation_step(header, change, *_CAMERAS_AND_POINTS, _unmasked(any_picture))
        for any_picture, change in ((picture, 0.01), (padded_picture, 0.005))
    ]

    assert translation_step(steps[1]) == pytest.approx(translation_step(steps[0]), rel=0.05)


def test_a_stream_has_the_step_of_its_frame_0_but_a_segment_does_not(monkeypatch):
    monkeypatch.setattr(encode_stream, "measure_error", lambda *_, **__: 0.5)
    canonical = replace(SMALL.canonical, iterations=2)
    config = replace(SMALL, steps=_ERROR_SETTINGS, canonical=canonical)

    def encode_header(capture):
        sink = io.BytesIO()
        encode(capture, sink, EncodeOptions(config, 1, "cpu", checks=False))
        return wire.parse_stream_header(next(split_chunks(sink.getvalue())).payload)

    capture = make_capture()
    adapted = adapt_steps_to_capture(config, capture)
    expected = adapt_steps_to_error(adapted, capture, 0.5).stream.translation_step
    assert encode_header(capture).translation_step == expected
    segment_step = encode_header(slice_capture(capture, 0, 1)).translation_step
    assert segment_step == adapted.stream.translation_step != expected
