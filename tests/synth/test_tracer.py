import numpy as np
import pytest

from quarc_ref.datasets.capture import join_points
from quarc_ref.synth.furniture import make_room
from quarc_ref.synth.options import SynthOptions, make_generator
from quarc_ref.synth.paints import Paint, choose_palette
from quarc_ref.synth.render_kernels import measure_depths
from quarc_ref.synth.rig import place_cameras
from quarc_ref.synth.scene import make_scene
from quarc_ref.synth.scene_arrays import pack_scene_arrays
from quarc_ref.synth.solids import ball, box, translate
from quarc_ref.synth.tracer import trace_alpha, trace_points, trace_view

_OPTIONS = SynthOptions(width=64, height=48)
_CENTER = np.array([0.3, 0.9, 0.2])
_RED = Paint(0, (0.9, 0.02, 0.02), (0.0,) * 3, (0.0,) * 3, gloss=0.2)


@pytest.fixture(scope="module")
def scene_arrays():
    return _pack_with_room([ball(translate(*_CENTER), 0.3, _RED)])


@pytest.fixture(scope="module")
def cameras():
    return place_cameras(_OPTIONS)


def _pack_with_room(*groups):
    return pack_scene_arrays(groups, make_room(0.5, choose_palette(0)))


def _project(camera, point):
    x, y, depth = camera.axes @ (point - camera.center)
    column = camera.focal_length * x / depth + camera.width / 2
    row = camera.focal_length * y / depth + camera.height / 2
    return int(row), int(column), depth


def test_every_camera_sees_a_ball_at_the_projection_of_its_center(scene_arrays, cameras):
    for camera in cameras:
        row, column, depth = _project(camera, _CENTER)
        red, green, blue = trace_view(scene_arrays, camera).picture[row, column].astype(int)
        depths = np.empty(1)
        measure_depths(scene_arrays, camera.as_row(), np.array([[column + 0.5, row + 0.5]]), depths)

        assert red > 2 * max(green, blue)
        assert depths[0] == pytest.approx(depth - 0.3, abs=0.01)


def test_depths_range_from_the_floor_in_front_to_the_back_wall(scene_arrays, cameras):
    view = trace_view(scene_arrays, cameras[0])
    corners = np.array([(x, y, -2.7) for x in (-3.7, 3.7) for y in (0, 3.2)])
    depths = (corners - cameras[0].center) @ cameras[0].axes[2]

    assert 2 < view.min_depth < 3
    assert depths.min() < view.max_depth < depths.max()


def test_points_lie_on_the_surfaces_and_have_their_colors(scene_arrays, cameras):
    picture = trace_view(scene_arrays, cameras[2]).picture
    points = trace_points(scene_arrays, cameras[2], picture, 3000, make_generator(0, "points"))
    colors = points.colors.astype(int)
    red_points = points.positions[colors[:, 0] > 3 * colors[:, 1:].max(axis=1)]
    distances = np.linalg.norm(red_points - _CENTER, axis=1)

    assert len(red_points) > 30  # enough to judge
    # Some points may fail: an edge pixel can be red although its center is next to the ball.
    assert (np.abs(distances - 0.3) < 0.01).mean() > 0.8


def test_noise_of_points_is_within_two_millimeters(scene_arrays, cameras):
    picture = trace_view(scene_arrays, cameras[2]).picture
    points = trace_points(scene_arrays, cameras[2], picture, 3000, make_generator(0, "points"))
    heights = points.positions[points.positions[:, 1] < 0.008, 1]

    assert heights.std() == pytest.approx(0.002, rel=0.2)
    assert abs(heights.mean()) < 0.001


def test_an_object_shadows_the_floor_below_it(cameras):
    camera = cameras[0]
    shadowed_arrays, lit_arrays = (
        _pack_with_room([box(translate(0, 0.5, 0), (0.3, 0.02, 0.3), _RED)]),
        _pack_with_room([box(translate(0, 3.19, 3), (0.3, 0.02, 0.3), _RED)]),
    )
    row, column, _ = _project(camera, np.array([0.1, 0.0, -0.1]))
    dark, bright = (
        trace_view(scene_arrays, camera).picture[row, column].mean()
        for scene_arrays in (shadowed_arrays, lit_arrays)
    )

    assert dark < 0.85 * bright


def test_culling_does_not_change_a_picture(cameras):
    scene_arrays = make_scene(2).at_time(0.6)
    solids, groups = scene_arrays.solids.copy(), scene_arrays.groups.copy()
    solids[:, 3] = groups[:, 3] = 50.0
    arrays_without_culling = scene_arrays._replace(solids=solids, groups=groups)
    for camera in (cameras[0], cameras[1]):
        culled, unculled = (
            trace_view(scene_arrays, camera),
            trace_view(arrays_without_culling, camera),
        )

        np.testing.assert_array_equal(culled.picture, unculled.picture)


def test_parts_are_joined_in_order(scene_arrays, cameras):
    picture = trace_view(scene_arrays, cameras[1]).picture
    parts = [
        trace_points(scene_arrays, cameras[1], picture, count, make_generator(0, "points"))
        for count in (2, 3)
    ]
    joined_points = join_points(parts)

    np.testing.assert_array_equal(joined_points.positions[2:], parts[1].positions)
    assert joined_points.colors.shape == (5, 3)


def test_alpha_is_the_share_of_a_pixel_that_the_subject_covers(scene_arrays, cameras):
    camera = cameras[2]
    below_the_floor = _pack_with_room([ball(translate(0.0, -2.0, 0.0), 0.1, _RED)])
    alpha = trace_alpha(scene_arrays, below_the_floor, camera)

    row, column, depth = _project(camera, _CENTER)
    radius = 0.3 * camera.focal_length / depth
    rows, columns = np.indices(alpha.shape)
    distances = np.hypot(rows - row, columns - column)
    assert (alpha[distances < radius - 2] == 255).all()
    assert (alpha[distances > radius + 2] == 0).all()
    assert alpha.sum() / 255 == pytest.approx(np.pi * radius**2, rel=0.1)
    assert len(np.unique(alpha)) > 5
