import copy
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.datasets.camera_geometry import camera_center
from quarc_ref.datasets.findings import format_names
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder.checks.capture_checks import check_capture
from quarc_ref.encoder.segments import slice_capture
from quarc_ref.format.errors import EncodeError, UnusableCaptureError
from quarc_ref.synth import SynthOptions, write_synthetic_capture
from quarc_ref.synth.variants import VARIANTS
from tests.encoder.checks.planted import (
    fade_subject,
    keep_cameras,
    move_camera,
    move_points,
    paint_points,
    plant,
    swap_pictures,
    turn_camera,
)
from tests.marks import thorough

_FAST_VARIANTS = ("playroom", "dark-stage")
_VARIANTS = [name if name in _FAST_VARIANTS else thorough(name) for name in VARIANTS]


@pytest.fixture(scope="module")
def trace_capture(tmp_path_factory):
    """Return a function that renders a synthetic capture of one frame, or returns a cached one."""
    defaults = {"width": 96, "height": 72, "frames": 1, "cameras": 8}
    root, traced = tmp_path_factory.mktemp("traced"), {}

    def make(**options):
        name = "-".join(f"{key}-{value}" for key, value in options.items()) or "playroom"
        if name not in traced:
            write_synthetic_capture(root / name, SynthOptions(**defaults | options))
            traced[name] = open_capture(root / name)
        return traced[name]

    return make


@pytest.fixture(scope="module")
def correct_capture(trace_capture):
    return trace_capture(frames=2)


def _list_kinds(capture):
    return [finding.kind for finding in check_capture(capture)]


@pytest.mark.parametrize("variant", _VARIANTS)
def test_an_honest_variant_has_no_findings(trace_capture, variant):
    assert check_capture(trace_capture(variant=variant)) == []


class BlackMasks:
    """Masks that exclude all pixels of some cameras."""

    def __init__(self, *cameras):
        self._cameras = cameras

    def read(self, camera, _frame):
        return np.zeros((72, 96), dtype=bool) if camera in self._cameras else None


def test_a_black_mask_of_a_training_camera_is_reported(correct_capture):
    training, held_out = copy.copy(correct_capture), copy.copy(correct_capture)
    training.masks, held_out.masks = BlackMasks(2), BlackMasks(0)

    (finding,) = check_capture(training)
    assert (finding.kind, finding.cameras) == ("mask-black", ("cam02",))
    assert check_capture(held_out) == []


def test_a_capture_whose_masks_leave_no_pixel_is_unusable(correct_capture):
    capture = copy.copy(correct_capture)
    capture.masks = BlackMasks(*capture.training)

    with pytest.raises(UnusableCaptureError, match="masks of all training cameras are completely"):
        check_capture(capture)


@pytest.fixture(scope="module")
def subject_capture(trace_capture):
    return trace_capture(variant="bright-stage", cameras=12, has_masks=True)


def test_masks_of_0_and_1_are_almost_black_alpha(subject_capture):
    (finding,) = check_capture(fade_subject(subject_capture, [2, 3], 1))
    assert (finding.kind, finding.cameras) == ("mask-black", ("cam02", "cam03"))

    with pytest.raises(UnusableCaptureError, match=r"at most 1 of 255.*255 stands for opaque"):
        check_capture(fade_subject(subject_capture, range(13), 1))
    assert check_capture(fade_subject(subject_capture, range(13), 128)) == []


def test_two_cameras_that_do_not_see_the_subject_have_different_pictures(subject_capture):
    findings = check_capture(fade_subject(subject_capture, [2, 3], 0))
    assert [(finding.kind, finding.cameras) for finding in findings] == [
        ("pose-disagrees", ("cam02", "cam03"))
    ]


@pytest.mark.parametrize("cameras", [4, 12, thorough(13), thorough(30)])
def test_enough_cameras_have_no_findings(trace_capture, cameras):
    assert check_capture(trace_capture(cameras=cameras)) == []


@pytest.mark.parametrize("seed", [1, thorough(2)])
def test_another_seed_has_no_findings(trace_capture, seed):
    assert check_capture(trace_capture(seed=seed)) == []


@pytest.mark.parametrize(("width", "height"), [(64, 48), thorough(320, 240)])
def test_another_size_has_no_findings(trace_capture, width, height):
    assert check_capture(trace_capture(width=width, height=height, cameras=8)) == []


@pytest.mark.capture
def test_a_real_capture_has_no_findings(real_capture):
    assert check_capture(open_capture(real_capture)) == []
    assert check_capture(open_capture(real_capture, CaptureOptions(downscale=2))) == []


@pytest.mark.parametrize("cameras", [2, 3])
def test_cameras_far_apart_are_too_few(trace_capture, cameras):
    (finding,) = check_capture(trace_capture(cameras=cameras))

    assert finding.kind == "too-few-cameras"
    assert f"{cameras} training cameras are too few" in finding.message
    assert finding.cameras == ()


def test_two_cameras_side_by_side_are_too_few(trace_capture):
    (finding,) = check_capture(keep_cameras(trace_capture(cameras=30), [0, 15, 16]))

    assert finding.kind == "too-few-cameras"
    assert "100% of the initial points are seen by fewer than 3" in finding.message


@pytest.mark.parametrize(("distance", "kinds"), [(0, []), (500, []), (3000, ["distant-origin"])])
def test_a_world_origin_far_from_the_scene_is_reported(correct_capture, distance, kinds):
    shift = np.array([distance, 0.0, 0.0])
    cameras = [
        replace(
            camera,
            translation=tuple(
                np.array(camera.translation) - np.array(camera.rotation).reshape(3, 3) @ shift
            ),
        )
        for camera in correct_capture.cameras
    ]
    moved = move_points(plant(correct_capture, cameras=cameras), 1.0, tuple(shift))

    assert _list_kinds(moved) == kinds


def test_cameras_in_one_place_are_reported(correct_capture):
    source = correct_capture.cameras[3]
    center = camera_center(source)
    cameras = [
        replace(camera, translation=tuple(-np.array(camera.rotation).reshape(3, 3) @ center))
        for camera in correct_capture.cameras
    ]

    assert "cameras-in-one-place" in _list_kinds(plant(correct_capture, cameras=cameras))


def test_one_training_camera_is_rejected(correct_capture):
    with pytest.raises(
        UnusableCaptureError, match="1 training camera, but estimating depth needs at least 2"
    ):
        check_capture(keep_cameras(correct_capture, [0, 5]))
    assert issubclass(UnusableCaptureError, EncodeError)


def test_points_of_another_scene_are_rejected(correct_capture):
    with pytest.raises(UnusableCaptureError, match="none of the 8000 initial points of capture"):
        check_capture(move_points(correct_capture, 1.0, (500.0, 0.0, 0.0)))


def test_many_points_outside_all_views_are_reported(correct_capture):
    (finding,) = check_capture(move_points(correct_capture, 0.4, (0.0, 0.0, 90.0)))

    assert finding.kind == "points-outside-views"
    assert (
        "40% of the initial points are not visible in any training view (40% are behind"
        in finding.message
    )


def test_a_few_points_outside_all_views_are_not_a_finding(correct_capture):
    assert check_capture(move_points(correct_capture, 0.1, (0.0, 0.0, 90.0))) == []


def test_a_camera_that_looks_away_is_named(correct_capture):
    (finding,) = check_capture(turn_camera(correct_capture, 4, 1, 180))

    assert (finding.kind, finding.cameras) == ("camera-sees-no-points", ("cam04",))
    assert "visible in the pictures of cam04" in finding.message


@pytest.mark.parametrize("variant", _VARIANTS)
def test_swapped_pictures_are_named(trace_capture, variant):
    (finding,) = check_capture(swap_pictures(trace_capture(variant=variant), 5, 6))

    assert (finding.kind, finding.cameras) == ("poses-mixed-up", ("cam05", "cam06"))
    assert "cam05 fits the pose of cam06, cam06 fits the pose of cam05" in finding.message


def test_a_shuffled_order_of_poses_is_found(correct_capture):
    count = len(correct_capture.cameras)
    order = [0, *(1 + np.random.default_rng(3).permutation(count - 1)).tolist()]
    (finding,) = check_capture(plant(correct_capture, order=order))

    moved_cameras = [f"cam{index:02}" for index in range(count) if order[index] != index]
    assert (finding.kind, list(finding.cameras)) == ("poses-mixed-up", moved_cameras)


@pytest.mark.parametrize("variant", ["playroom", thorough("dark-stage"), thorough("mixed-cameras")])
@pytest.mark.parametrize(
    ("axis", "degrees"), [(1, 3), (1, -8), (0, 5), (0, 15), (2, 30), thorough(2, 180)]
)
def test_a_rotated_camera_is_named(trace_capture, variant, axis, degrees):
    capture = trace_capture(variant=variant, cameras=12)
    (finding,) = check_capture(turn_camera(capture, 7, axis, degrees))

    assert (finding.kind, finding.cameras) == ("pose-disagrees", ("cam07",))


@pytest.mark.parametrize("paints_points", [False, True])
def test_a_camera_that_sees_the_subject_elsewhere_is_named(subject_capture, paints_points):
    capture = subject_capture
    if paints_points:  # as points inside the subject
        colors = np.random.default_rng(0).integers(0, 256, capture.points.colors.shape, np.uint8)
        capture = paint_points(capture, colors)
    assert check_capture(capture) == []

    (finding,) = check_capture(turn_camera(capture, 7, 1, 10))

    assert (finding.kind, finding.cameras) == ("pose-disagrees", ("cam07",))
    assert finding.message.endswith("use --held-out cam00 --held-out cam07")


@pytest.mark.parametrize("step", [(0.3, 0, 0), (0, -0.3, 0), (0, 0, -1.0)])
def test_a_displaced_camera_is_named(correct_capture, step):
    (finding,) = check_capture(move_camera(correct_capture, 2, step))

    assert (finding.kind, finding.cameras) == ("pose-disagrees", ("cam02",))
    assert finding.message.endswith("use --held-out cam00 --held-out cam02")


def test_points_with_wrong_colors_disagree_with_all_pictures(correct_capture):
    colors = np.random.default_rng(0).integers(
        0, 256, correct_capture.points.colors.shape, dtype=np.uint8
    )
    (finding,) = check_capture(paint_points(correct_capture, colors))

    assert finding.kind == "pose-disagrees"
    assert len(finding.cameras) == 8
    assert "cam01, cam02, cam03, cam04, cam05 and 3 more" in finding.message
    assert "--held-out" not in finding.message  # no camera would be left to train


def test_points_of_one_color_give_no_evidence_about_poses(correct_capture):
    colors = np.full_like(correct_capture.points.colors, 127)

    assert check_capture(paint_points(correct_capture, colors)) == []


def test_colors_of_points_are_those_of_the_first_frame_of_the_whole_capture(correct_capture):
    class UnreadableSource:
        def read(self, camera, frame):
            message = f"frame {frame} of camera {camera} is read"
            raise AssertionError(message)

    segment = slice_capture(correct_capture, 1, 1)
    segment._source = UnreadableSource()

    assert check_capture(segment) == []


def test_a_held_out_picture_is_not_read(correct_capture):
    order = [99, *range(1, len(correct_capture.cameras))]

    assert check_capture(plant(correct_capture, order=order)) == []


def test_one_fault_does_not_hide_another(correct_capture):
    faulty = turn_camera(turn_camera(correct_capture, 3, 1, 180), 8, 0, 10)

    assert _list_kinds(faulty) == ["camera-sees-no-points", "pose-disagrees"]


def test_names_after_the_fifth_are_counted():
    assert format_names([*"abcde"]) == "a, b, c, d, e"
    assert format_names([*"abcdefg"]) == "a, b, c, d, e and 2 more"
