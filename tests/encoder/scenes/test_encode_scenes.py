"""Decoded Gaussians equal the input of `encode_scenes` within the bounds."""

import io
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.encoder import GivenFrame, SceneOptions, encode_scenes
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import decode
from quarc_ref.streams.decode_stream import decode_states
from tests.encoder.scenes.encoding import OPTIONS, assert_close, encode
from tests.encoder.scenes.given import concatenate, make_splats, move, select_rows
from tests.small_streams import make_stream


@pytest.mark.parametrize("coefficients", [1, 4, 9, 16])
def test_one_frame_is_within_the_bounds(coefficients):
    splats = make_splats(coefficients=coefficients)
    data, report = encode([splats])

    assert_close(data, [splats])
    assert report.dropped_sh_degree == {1: 0, 4: 0, 9: 2, 16: 3}[coefficients]


def test_frames_with_other_sh_degrees_are_matched():
    first_splats = make_splats(coefficients=4)
    second_splats = select_rows(make_splats(coefficients=16), np.arange(5, 200))
    second_splats = replace(second_splats, sh=second_splats.sh.copy())
    second_splats.sh[:, :4] = first_splats.sh[5:]
    data, report = encode([first_splats, second_splats])

    assert_close(data, [first_splats, second_splats])
    assert report.dropped_sh_degree == 3
    last = list(decode_states(data))[-1]
    assert last.births is None or last.births.newborn.count == 0
    with pytest.raises(EncodeError, match="lower SH degree than the first frame"):
        encode([first_splats, select_rows(make_splats(coefficients=1), np.arange(5, 200))])


def test_moving_and_rotating_gaussians_keep_their_identity():
    first_splats = make_splats()
    scenes = [
        first_splats,
        move(first_splats, (0.03, 0, 0), 0.1),
        move(first_splats, (0.05, 0.01, 0), 0.15),
    ]
    data, _ = encode(scenes)

    assert_close(data, scenes)
    states = list(decode_states(data))
    assert all(np.array_equal(state.scene.ids, states[0].scene.ids) for state in states)
    assert any(np.any(level) for level in states[1].symbols)


def test_recolored_gaussians_are_updated_or_replaced():
    first_splats = make_splats()
    sh, sh_rest = first_splats.sh.copy(), first_splats.sh.copy()
    sh[10:15, 0] += 0.2
    sh_rest[20:25, 2] += 0.3  # updates cannot change SH rest
    scenes = [first_splats, replace(first_splats, sh=sh), replace(first_splats, sh=sh_rest)]
    data, _ = encode(scenes)

    assert_close(data, scenes)
    states = list(decode_states(data))
    assert states[1].births is None or states[1].births.newborn.count == 0
    assert states[2].births.newborn.count == 5


@pytest.mark.parametrize("with_ids", [True, False])
def test_arrivals_and_departures_are_found_by_ids_or_by_order(with_ids):
    first_splats, new_splats = make_splats(), make_splats(12, seed=9)
    kept_rows = np.delete(np.arange(200), [3, 50, 51, 120])
    second_splats = concatenate(
        move(select_rows(first_splats, kept_rows), (0.02, 0, 0)), new_splats
    )
    ids = [np.arange(200), np.concatenate([kept_rows, 500 + np.arange(12)])]
    scenes = [first_splats, second_splats]
    frames = [GivenFrame(*pair) for pair in zip(scenes, ids, strict=True)] if with_ids else scenes
    data, _ = encode(frames)

    assert_close(data, scenes)
    last = list(decode_states(data))[-1]
    assert last.births.newborn.count == 12
    assert np.count_nonzero(last.scene.ids < 200) == 196


def test_births_are_within_the_bounds_if_the_first_frame_has_rotations_on_a_coarse_grid():
    splats = make_splats()
    identities = np.tile(np.float32([1, 0, 0, 0]), (len(splats.positions), 1))
    first_splats = replace(splats, rotations=identities)
    second_splats = concatenate(first_splats, make_splats(count=190, seed=5))
    data, _ = encode(
        [GivenFrame(first_splats, np.arange(200)), GivenFrame(second_splats, np.arange(390))]
    )

    assert_close(data, [first_splats, second_splats])
    assert list(decode_states(data))[-1].births.newborn.count == 190


def test_ids_identify_gaussians_in_any_order():
    first_splats = make_splats()
    shuffled = np.random.default_rng(2).permutation(200)
    second_splats = select_rows(move(first_splats, (0.01, 0, 0)), shuffled)
    data, _ = encode(
        [GivenFrame(first_splats, np.arange(200)), GivenFrame(second_splats, shuffled)]
    )

    assert_close(data, [first_splats, second_splats])
    assert list(decode_states(data))[-1].scene.ids.max() == 199


def test_a_frame_that_is_mostly_new_is_canonical():
    scenes = [make_splats(), make_splats(seed=5)]
    data, _ = encode(scenes)

    assert_close(data, scenes)
    assert [scene.phase for scene in decode(data)] == [0, 0]


@pytest.mark.parametrize("fraction", [0.1, 1.0])
def test_a_frame_with_gaussians_too_far_for_updates_and_births_is_canonical(fraction):
    first_splats = make_splats()
    second_splats = move(first_splats, (1000, 0, 0), fraction=fraction)
    data, _ = encode([first_splats] * 3 + [second_splats], SceneOptions(bounds=Bounds(0.01)))

    assert_close(data, [first_splats] * 3 + [second_splats], position=0.01)
    assert [scene.phase for scene in decode(data)] == [0, 1, 2, 0]


def test_canonical_frames_are_as_frequent_as_requested():
    first_splats = make_splats()
    scenes = [first_splats] * 5
    data, _ = encode(scenes, replace(OPTIONS, keyframe_interval=2))

    assert_close(data, scenes)
    assert [scene.phase for scene in decode(data)] == [0, 1, 0, 1, 0]


def test_a_decoded_stream_encoded_again_keeps_its_first_frame_exactly():
    header = StreamHeader(seed=7, updates=True, rotation_bits=8)
    original, _ = make_stream(header, 60)
    scenes = [dequantize(scene) for scene in decode(original)]
    data, report = encode(scenes, SceneOptions(bounds=Bounds(position=2**-10)))

    decoded_again = dequantize(next(iter(decode(data))))
    assert np.array_equal(decoded_again.positions, scenes[0].positions)
    assert np.array_equal(decoded_again.log_scales, scenes[0].log_scales)
    assert np.array_equal(decoded_again.sh, scenes[0].sh)
    assert report.errors.log_scale == report.errors.sh_dc == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"positions": np.full((200, 3), np.nan, np.float32)}, "non-finite"),
        ({"rotations": np.zeros((200, 4), np.float32)}, "zero quaternion"),
        ({"log_scales": np.full((200, 3), 1e6, np.float32)}, r"exceeds|not finite"),
    ],
)
def test_frames_that_no_stream_can_hold_are_rejected_by_number(change, message):
    splats = make_splats()

    with pytest.raises(EncodeError, match=message):
        encode([splats, replace(splats, **change)])


@pytest.mark.parametrize(
    ("field", "attribute"),
    [
        ("positions", "position"),
        ("log_scales", "log_scale"),
        ("opacities", "opacity"),
        ("sh", "sh_(dc|rest)"),
    ],
)
def test_an_attribute_out_of_range_is_named_with_its_gaussian(field, attribute):
    splats = make_splats()
    numbers = getattr(splats, field).copy()
    numbers[7] = -1e6

    with pytest.raises(EncodeError, match=f"^frame 3: the {attribute} of Gaussian 7 exceeds"):
        encode([splats] * 3 + [replace(splats, **{field: numbers})])


@pytest.mark.parametrize("ordinal", [0, 1, 3])
@pytest.mark.parametrize("opacity", [None, np.inf])
def test_an_empty_or_infinite_frame_is_rejected_by_number(ordinal, opacity):
    splats = make_splats()
    bad_splats = select_rows(splats, np.arange(0))
    if opacity is not None:
        bad_splats = replace(splats, opacities=np.full(200, opacity, np.float32))
    frames = [splats] * ordinal + [bad_splats]

    with pytest.raises(EncodeError, match=f"frame {ordinal}: .*(no Gaussians|non-finite)"):
        encode(frames, SceneOptions())


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("positions", (200, 2)),
        ("rotations", (199, 4)),
        ("log_scales", (200,)),
        ("opacities", (200, 1)),
        ("sh", (200, 3)),
        ("sh", (200, 5, 3)),
    ],
)
def test_an_array_of_a_wrong_shape_is_named(name, shape):
    splats = replace(make_splats(), **{name: np.zeros(shape, np.float32)})

    with pytest.raises(EncodeError, match=f"frame 0: the field {name} has the shape"):
        encode([splats], SceneOptions())


@pytest.mark.parametrize("ids", [np.zeros(200, np.int64), np.arange(3), np.linspace(0, 1, 200)])
def test_ids_that_do_not_identify_the_gaussians_are_rejected(ids):
    with pytest.raises(EncodeError, match="frame 1: ids must be 200 different integers"):
        encode([GivenFrame(make_splats(), np.arange(200)), GivenFrame(make_splats(), ids)])


@pytest.mark.parametrize(
    "options", [{"keyframe_interval": -1}, {"first_frame": -1}, {"first_frame": 1 << 32}]
)
def test_an_option_out_of_range_is_named(options):
    (number,) = options.values()
    with pytest.raises(ValueError, match=rf"\({number}\)"):
        encode_scenes([make_splats(3)], io.BytesIO(), SceneOptions(**options))


def test_an_empty_input_is_rejected():
    with pytest.raises(EncodeError, match="no frames"):
        encode([])


def test_frames_are_read_one_at_a_time():
    first_splats = make_splats()
    read = []

    def scenes():
        for number in range(6):
            read.append(number)
            yield first_splats

    sink = io.BytesIO()
    written = []

    class Progress:
        def advance(self, _stage, _done, _total):
            written.append(max(read))

    encode_scenes(scenes(), sink, replace(OPTIONS, progress=Progress()))

    assert written == [2, 2, 2, 3, 4, 5]


def test_torch_is_not_loaded():
    code = "import sys; from quarc_ref.encoder import encode_scenes; print('torch' in sys.modules)"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )

    assert process.stdout.strip() == "False"
