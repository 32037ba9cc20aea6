"""Edits of all frames give the expected Gaussians in every frame."""

import io
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.encoder import GivenFrame, SceneOptions, encode_scenes
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.edits import Edit, Similarity, edit_frames
from quarc_ref.encoder.scenes.fit_edit import encode_edited
from quarc_ref.encoder.scenes.recolor import Recoloring
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import decode
from quarc_ref.streams.cut import cut
from quarc_ref.streams.join import join
from quarc_ref.streams.prologue import read_prologue
from quarc_ref.streams.source import BytesSource
from tests.encoder.scenes.given import make_splats, move

_BOUNDS = Bounds(position=0.001)
_CAMERA = Camera(
    "front", 64, 48, 60.0, 60.0, 32.0, 24.0, (1, 0, 0, 0, 1, 0, 0, 0, 1), (0, 0, 2), 0.5, False
)
_ROTATION_AND_SCALE = np.array(
    [[0, 0, 2, 1], [0, 2, 0, 2], [-2, 0, 0, 3]], dtype=float
)  # rotation around y, scale 2


@pytest.fixture(scope="module")
def stream():
    """A stream of three frames of moving Gaussians, with a camera."""
    first_splats = make_splats()
    scenes = [
        first_splats,
        move(first_splats, (0.03, 0, 0), 0.1),
        move(first_splats, (0.06, 0, 0), 0.2),
    ]
    sink = io.BytesIO()
    header = StreamHeader(updates=True, up_axis=4, meters_per_unit=3.0)
    encode_scenes(scenes, sink, SceneOptions(_BOUNDS, cameras=(_CAMERA,), header=header))
    return sink.getvalue()


def edit_stream(stream, edit):
    sink = io.BytesIO()
    report = encode_edited(BytesSource(stream), sink, edit, SceneOptions(_BOUNDS))
    assert report.frames == 3
    return sink.getvalue()


def decode_frames(stream):
    return [dequantize(scene) for scene in decode(stream)]


def measure_psnr(first_splats, second):
    return 10 * np.log10(1 / max(1e-12, float(np.mean((first_splats - second) ** 2))))


def test_a_crop_keeps_the_inside_of_the_box_in_every_frame(stream):
    box = (-0.2, -0.3, -0.5, 0.3, 0.3, 0.5)
    for original, edited_splats in zip(
        decode_frames(stream), decode_frames(edit_stream(stream, Edit(boxes=(box,)))), strict=True
    ):
        inside = np.all((original.positions >= box[:3]) & (original.positions <= box[3:]), axis=1)
        assert 0 < inside.sum() == len(edited_splats.positions) < len(inside)


def test_a_drop_keeps_the_outside_of_the_sphere(stream):
    sphere = (0.1, 0.0, 0.0, 0.4)
    for original, edited_splats in zip(
        decode_frames(stream),
        decode_frames(edit_stream(stream, Edit(spheres=(sphere,)))),
        strict=True,
    ):
        outside = np.linalg.norm(original.positions - np.array(sphere[:3]), axis=1) > sphere[3]
        assert 0 < outside.sum() == len(edited_splats.positions) < len(outside)


def test_a_transformed_scene_looks_to_its_cameras_as_before(stream):
    transformed = edit_stream(stream, Edit(similarity=Similarity.from_matrix(_ROTATION_AND_SCALE)))
    (camera,), _ = read_prologue(BytesSource(transformed))

    for original, edited_splats in zip(
        decode_frames(stream), decode_frames(transformed), strict=True
    ):
        assert (
            measure_psnr(render_picture(original, _CAMERA), render_picture(edited_splats, camera))
            > 45
        )
    header = next(iter(decode(transformed))).header
    assert header.up_axis == 4  # a rotation around y does not change the y axis
    assert header.meters_per_unit == 1.5


def test_the_up_axis_is_rotated_as_well_or_becomes_unknown():
    header = StreamHeader(up_axis=3)
    about_x = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0]], dtype=float)
    half = np.sqrt(0.5)
    about_x_by_45_degrees = np.array([[1, 0, 0, 0], [0, half, -half, 0], [0, half, half, 0]])

    assert Similarity.from_matrix(about_x).apply_to_header(header).up_axis == 5
    assert Similarity.from_matrix(about_x_by_45_degrees).apply_to_header(header).up_axis == 0


@pytest.mark.parametrize(
    ("scale", "message"),
    [
        (1e-7, "a world unit would be 3e\\+07 m"),
        (1e-45, "a world unit would be inf m"),
        (1e60, "too far away"),
    ],
)
def test_a_scale_that_a_stream_cannot_store_is_explained(scale, message, stream):
    scaling = Similarity.from_matrix(np.diag([scale, scale, scale, 1.0]))
    with pytest.raises(EncodeError, match=message):
        edit_stream(stream, Edit(similarity=scaling))


def test_cameras_and_metadata_change_at_the_same_frames(stream):
    second_camera = replace(_CAMERA, name="second")
    frames = [
        GivenFrame(splats, cameras=cameras, metadata={"note": note})
        for splats, cameras, note in zip(
            decode_frames(stream),
            [(_CAMERA,), (_CAMERA, second_camera), (_CAMERA, second_camera)],
            ["a", "a", "b"],
            strict=True,
        )
    ]
    sink = io.BytesIO()
    encode_scenes(frames, sink, SceneOptions(_BOUNDS))
    similarity = Similarity.from_matrix(_ROTATION_AND_SCALE)

    edited = edit_stream(sink.getvalue(), Edit(similarity=similarity))

    decoder = StreamDecoder()
    side_data = [
        ([camera.name for camera in decoder.cameras], decoder.metadata["note"])
        for _ in decode(edited, decoder=decoder)
    ]
    both = ["front", "second"]
    assert side_data == [(["front"], "a"), (both, "a"), (both, "b")]
    expected_camera = similarity.apply_to_camera(second_camera)
    assert decoder.cameras[1].translation == pytest.approx(expected_camera.translation)


def test_frames_of_a_cut_keep_their_numbers(stream):
    joined, later_part = io.BytesIO(), io.BytesIO()
    join([BytesSource(stream), BytesSource(stream)], joined)
    cut(BytesSource(joined.getvalue()), 3, None, later_part)
    edited = edit_stream(later_part.getvalue(), Edit(boxes=((-0.2, -0.3, -0.5, 0.3, 0.3, 0.5),)))

    assert [scene.frame for scene in decode(edited)] == [3, 4, 5]


@pytest.mark.parametrize(
    ("up_axis", "metadata"), [(4, {}), (0, {"up": "0 -1 0"}), (4, {"up": "1 0 0"})]
)
def test_an_up_direction_that_is_not_along_an_axis_becomes_metadata(stream, up_axis, metadata):
    half = np.sqrt(0.5)
    about_x_by_45_degrees = np.array([[1, 0, 0, 0], [0, half, -half, 0], [0, half, half, 0]])
    similarity = Similarity.from_matrix(about_x_by_45_degrees)
    sink = io.BytesIO()
    options = SceneOptions(
        _BOUNDS, metadata=metadata, header=StreamHeader(updates=True, up_axis=up_axis)
    )
    encode_scenes(decode_frames(stream), sink, options)
    edited = edit_stream(sink.getvalue(), Edit(similarity=similarity))

    assert read_prologue(BytesSource(edited))[1]["up"] == "0.000000 -0.707107 -0.707107"
    assert next(iter(decode(edited))).header.up_axis == 0


@pytest.mark.parametrize("metadata", [{}, {"up": "up"}, {"up": "0 0 0"}, {"up": "0 1"}])
def test_an_unknown_up_direction_remains_unknown(metadata):
    similarity = Similarity.from_matrix(_ROTATION_AND_SCALE)

    assert similarity.apply_to_metadata(metadata, StreamHeader(up_axis=0)) == {}


def test_recoloring_with_a_crop_changes_the_remaining_gaussians(stream):
    box = (-0.2, -0.3, -0.5, 0.3, 0.3, 0.5)
    cropped = decode_frames(edit_stream(stream, Edit(boxes=(box,))))[0]
    colored = decode_frames(
        edit_stream(stream, Edit((box,), recoloring=Recoloring(offset=(0.1, 0, 0))))
    )[0]

    red = 0.28209479177387814 * (colored.sh[:, 0, 0].mean() - cropped.sh[:, 0, 0].mean())
    assert red == pytest.approx(0.1, abs=0.005)


def test_an_edit_that_removes_everything_is_rejected(stream):
    with pytest.raises(EncodeError, match="removes all Gaussians"):
        edit_stream(stream, Edit(boxes=((5, 5, 5, 6, 6, 6),)))


@pytest.mark.parametrize(
    "matrix",
    [
        np.diag([1.0, 1, -1, 1]),  # mirrors
        np.diag([1.0, 2, 1, 1]),
        np.diag([0.0, 0, 0, 1]),
        np.diag([1.0, 1, 1, 2]),
        np.full((3, 4), np.nan),
    ],
)
def test_a_matrix_that_is_not_a_similarity_is_rejected(matrix):
    with pytest.raises(ValueError, match="rotation"):
        Similarity.from_matrix(matrix)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 2, np.pi, -2.5])
def test_sh_coefficients_rotate_like_positions(axis, angle):
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.roll(np.array([[1, 0, 0], [0, c, -s], [0, s, c]]), axis, axis=(0, 1))
    splats = make_splats(50)
    rotated = Similarity.from_matrix(np.hstack([rotation, np.zeros((3, 1))])).apply(splats)

    def axes(rotations):
        w, x, y, z = rotations.T.astype(float)
        return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)

    assert axes(rotated.rotations) == pytest.approx(axes(splats.rotations) @ rotation.T, abs=1e-5)
    assert rotated.positions == pytest.approx(splats.positions @ rotation.T, abs=1e-5)


def test_ids_of_one_canonical_frame_are_not_those_of_the_next(stream):
    scenes = list(decode(stream))
    ids = [frame.ids for frame in edit_frames([*scenes, *scenes], Edit())]

    assert np.array_equal(ids[0], ids[2])
    assert not np.intersect1d(ids[0], ids[3]).size
