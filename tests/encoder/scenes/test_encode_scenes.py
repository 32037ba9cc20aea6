"""Decoded Gaussians equal the input of `encode_scenes` within the bounds."""

import io
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree

from quarc_ref.decoder import dequantize
from quarc_ref.encoder import GivenFrame, SceneOptions, encode_scenes
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.grids import find_common_divisor
from quarc_ref.encoder.scenes.slack import measure_slack
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import decode
from quarc_ref.streams.decode_stream import decode_states
from tests.encoder.scenes.given import concatenate, make_splats, move, select_rows
from tests.small_streams import make_stream

_OPTIONS = SceneOptions(bounds=Bounds(position=0.002))


def encode(scenes, options=_OPTIONS):
    sink = io.BytesIO()
    report = encode_scenes(scenes, sink, options)
    return sink.getvalue(), report


def find_nearest(decoded, expected):
    distances = np.linalg.norm(decoded.positions[:, None] - expected.positions[None], axis=2)
    return distances.argmin(axis=1), distances.min(axis=1)


def assert_close(data, scenes, position=0.002):
    """Check that decoded and input Gaussians match one to one within the default bounds."""
    frames = [dequantize(scene) for scene in decode(data)]
    assert len(frames) == len(scenes)
    for decoded, expected in zip(frames, scenes, strict=True):
        rows, _ = find_nearest(decoded, expected)
        assert sorted(rows) == list(range(len(expected.positions)))
        matched = select_rows(expected, rows)
        tolerance = 1e-5
        assert np.abs(decoded.positions - matched.positions).max() <= position + tolerance
        cosines = np.abs((decoded.rotations * matched.rotations).sum(axis=1))
        assert 2 * np.arccos(np.minimum(cosines, 1)).max() <= 0.02 + 1e-3
        assert np.abs(decoded.log_scales - matched.log_scales).max() <= 1 / 32 + tolerance
        assert np.abs(decoded.opacities - matched.opacities).max() <= 1 / 16 + tolerance
        degree_one = matched.sh[:, : decoded.sh.shape[1]]
        assert np.abs(decoded.sh - degree_one).max() <= 1 / 64 + tolerance


@pytest.mark.parametrize("coefficients", [1, 4, 9, 16])
def test_one_frame_is_within_the_bounds(coefficients):
    splats = make_splats(coefficients=coefficients)
    data, report = encode([splats])

    assert_close(data, [splats])
    assert report.dropped_sh_degree == {1: 0, 4: 0, 9: 2, 16: 3}[coefficients]


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


def test_canonical_frames_are_as_frequent_as_requested():
    first_splats = make_splats()
    scenes = [first_splats] * 5
    data, _ = encode(scenes, replace(_OPTIONS, keyframe_interval=2))

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


def test_the_bounds_are_in_the_metadata_and_the_errors_stay_within_them():
    first_splats = make_splats()
    data, report = encode([first_splats, move(first_splats, (0.02, 0, 0))])

    assert b"position=0.002 rotation=0.02" in data
    for name, bound in report.bounds.as_dict().items():
        assert 0 <= getattr(report.errors, name) <= bound * 1.001


def test_bounds_are_wider_where_errors_are_less_visible():
    first_splats = make_splats()
    second_splats = move(first_splats, (0.006, 0, 0), angle=0.03)
    strict, _ = encode([first_splats, second_splats])
    bounds = replace(SceneOptions().bounds, position=0.002, most_slack=4)
    loose, report = encode([first_splats, second_splats], SceneOptions(bounds=bounds))

    assert len(loose) < len(strict)
    assert b"most_slack=4" in loose
    assert b"most_slack" not in strict
    slack = measure_slack(second_splats, report.bounds)
    last = dequantize(list(decode(loose))[-1])
    _, nearest = cKDTree(second_splats.positions).query(last.positions)
    errors = np.abs(second_splats.positions[nearest] - last.positions).max(axis=1)
    assert (errors <= 0.002 * slack.position[nearest] * 1.001).all()
    assert errors.max() > 0.002


def test_large_round_or_faint_gaussians_have_slack():
    splats = make_splats(5)
    splats.log_scales[:] = [(0, 0, 0), (1, 1, 1), (-1, -1, 1), (0, 0, 0.25), (0, 0, 2)]
    splats.opacities[:] = (9, 9, 9, 9, 0)
    slack = measure_slack(splats, Bounds(position=1, most_slack=4, median_scale=1))

    assert slack.position == pytest.approx([1, np.e, 1, 1, 2], rel=1e-3)
    assert slack.rotation == pytest.approx([4, 4, 1, 4, 1], rel=1e-3)


def test_a_slack_below_1_is_rejected():
    with pytest.raises(ValueError, match=r"most_slack is 0\.5"):
        Bounds(most_slack=0.5)


def test_by_default_positions_are_bounded_by_the_scale_of_the_scene():
    splats = make_splats()
    _, report = encode([splats], SceneOptions())

    median = np.exp(np.median(splats.log_scales.mean(axis=1)))
    assert report.bounds.position == pytest.approx(0.05 * median, rel=1e-5)


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


class _Pipe(io.BytesIO):
    def seekable(self):
        return False


@pytest.fixture
def low_level(monkeypatch):
    """Let level 10 allow only 500 Gaussians and 64 births."""
    monkeypatch.setitem(LEVELS, 10, LEVELS[10]._replace(gaussians=500, births=64))


@pytest.mark.usefixtures("low_level")
@pytest.mark.parametrize("counts", [(200, 200, 200, 600), (200, 240, 280, 320, 500, 501)])
def test_the_level_is_raised_if_the_number_of_gaussians_grows(counts):
    all_splats = make_splats(max(counts))
    scenes = [select_rows(all_splats, np.arange(count)) for count in counts]
    sink = io.BytesIO(b"before")
    sink.seek(0, io.SEEK_END)
    encode_scenes(scenes, sink, _OPTIONS)
    data = sink.getvalue().removeprefix(b"before")

    assert_close(data, scenes)
    assert next(iter(decode(data))).header.level == 20


@pytest.mark.usefixtures("low_level")
def test_the_level_is_as_low_as_the_first_frames_allow():
    scenes = [make_splats(250)] * 3
    data, _ = encode(scenes)

    assert next(iter(decode(data))).header.level == 10


@pytest.mark.usefixtures("low_level")
def test_the_level_of_a_pipe_or_an_appended_file_cannot_be_raised(tmp_path):
    all_splats = make_splats(600)
    scenes = [select_rows(all_splats, np.arange(count)) for count in (200, 200, 200, 600)]
    path = tmp_path / "a.quarc"
    with path.open("ab") as appended_file:
        for sink in (_Pipe(), appended_file):
            with pytest.raises(EncodeError, match=r"frame 3: 600 Gaussians exceed level 10.*file"):
                encode_scenes(scenes, sink, _OPTIONS)


@pytest.mark.usefixtures("low_level")
def test_a_frame_that_replaces_too_many_gaussians_by_births_is_canonical():
    first_splats = make_splats()
    # No update can turn a Gaussian by 180 degrees.
    second_splats = move(first_splats, (0, 0, 0), angle=np.pi, fraction=0.4)
    frames = [GivenFrame(splats, np.arange(200)) for splats in (first_splats, second_splats)]
    data, _ = encode(frames)

    assert_close(data, [first_splats, second_splats])
    assert [scene.phase for scene in decode(data)] == [0, 0]
    assert next(iter(decode(data))).header.level == 10


@pytest.mark.parametrize("fraction", [0.1, 1.0])
def test_a_frame_with_gaussians_too_far_for_updates_and_births_is_canonical(fraction):
    first_splats = make_splats()
    second_splats = move(first_splats, (1000, 0, 0), fraction=fraction)
    data, _ = encode([first_splats] * 3 + [second_splats], SceneOptions(bounds=Bounds(0.01)))

    assert_close(data, [first_splats] * 3 + [second_splats], position=0.01)
    assert [scene.phase for scene in decode(data)] == [0, 1, 2, 0]


def test_the_level_is_raised_if_a_chunk_is_too_long(monkeypatch):
    monkeypatch.setitem(LEVELS, 10, LEVELS[10]._replace(chunk_bytes=2000))
    splats = make_splats()
    data, _ = encode([splats])

    assert_close(data, [splats])
    assert next(iter(decode(data))).header.level == 20


def test_bounds_that_are_too_narrow_for_the_extent_are_rejected():
    splats = make_splats()
    wide_splats = replace(splats, positions=splats.positions * 1e6)

    with pytest.raises(EncodeError, match="a stream cannot represent positions"):
        encode([wide_splats], SceneOptions(bounds=Bounds(position=1e-3)))


@pytest.mark.parametrize("grid", [None, 1 / 4096])
@pytest.mark.parametrize("name", ["position", "rotation", "log_scale", "opacity", "sh_dc"])
def test_bounds_may_be_huge_and_tiny_ones_are_rejected(name, grid):
    splats = make_splats()
    if grid:
        splats = replace(splats, positions=np.rint(splats.positions / grid).astype("f4") * grid)
    data, _ = encode([splats, splats], SceneOptions(bounds=Bounds(**{name: 1e300})))

    assert len(list(decode(data))) == 2
    with pytest.raises(EncodeError, match=r"bound|larger errors"):
        encode([splats, splats], SceneOptions(bounds=Bounds(**{name: 1e-320})))


@pytest.mark.parametrize(("outlier_count", "divisor"), [(0, 12), (19, 12), (20, 1)])
def test_a_common_divisor_has_few_outliers(outlier_count, divisor):
    numbers = 12 * np.random.default_rng(0).integers(1, 10_000, 1000)
    numbers[:outlier_count] = 1 + 60 * numbers[:outlier_count]

    assert find_common_divisor(numbers, 1 << 40) == divisor


def test_an_empty_input_is_rejected():
    with pytest.raises(EncodeError, match="no frames"):
        encode([])


@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), 0.0])
def test_a_bound_is_a_positive_number(value):
    with pytest.raises(ValueError, match="sh_dc"):
        Bounds(sh_dc=value)


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

    encode_scenes(scenes(), sink, replace(_OPTIONS, progress=Progress()))

    assert written == [2, 2, 2, 3, 4, 5]


def test_torch_is_not_loaded():
    code = "import sys; from quarc_ref.encoder import encode_scenes; print('torch' in sys.modules)"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )

    assert process.stdout.strip() == "False"
