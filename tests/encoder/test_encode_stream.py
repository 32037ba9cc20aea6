import contextlib
import io
import itertools
import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.datasets.errors import TooFewFramesError
from quarc_ref.decoder import dequantize
from quarc_ref.decoder.state import State
from quarc_ref.encoder import EncodeOptions, encode, encode_stream
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.frames.births import count_deaths
from quarc_ref.encoder.frames.rate_control import RateDistortion, choose_rd_factor
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.container import FRAM
from quarc_ref.format.errors import EncodeError, TruncatedError
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import decode
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.decode_stream import decode_states
from tests.encoder import toys
from tests.encoder.toys import SMALL, make_capture
from tests.small_streams import make_stream


def _encode(config=SMALL, frames=None) -> bytes:
    sink = io.BytesIO()
    encode(make_capture(), sink, EncodeOptions(config, frames, device="cpu"))
    return sink.getvalue()


def _decode_complete_frames(data: bytes) -> list[State]:
    """Return the state of each complete frame of an unfinished stream."""
    states = []
    with contextlib.suppress(TruncatedError):
        states.extend(decode_states(data))
    return states


def _frame_sizes(data: bytes) -> list[int]:
    """Return the size of each FRAM chunk of an unfinished stream, bytes."""
    sizes = []
    with contextlib.suppress(TruncatedError):
        sizes.extend(chunk.byte_count() for chunk in split_chunks(data) if chunk.kind == FRAM)
    return sizes


@pytest.fixture(scope="module")
def stream() -> bytes:
    return _encode()


def _measure_error(scene, capture) -> float:
    splats = dequantize(scene)
    errors = []
    for index in capture.training:
        truth = capture.image(index, scene.frame) / 255
        picture = np.clip(render_picture(splats, capture.cameras[index]), 0, 1)
        errors.append(np.square(picture - truth).mean())
    return float(np.mean(errors))


def test_every_frame_is_present_and_close_to_its_own_pictures(stream):
    capture = make_capture()
    scenes = list(decode(stream))

    errors = [_measure_error(scene, capture) for scene in scenes]
    stale_error = _measure_error(replace(scenes[0], frame=3), capture)

    assert [scene.frame for scene in scenes] == [0, 1, 2, 3]
    assert errors[3] < 0.8 * stale_error


def test_the_same_seed_gives_the_same_bytes(stream):
    assert _encode() == stream


def test_another_seed_gives_another_stream(stream):
    assert _encode(replace(SMALL, seed=1)) != stream


def test_births_are_added_and_as_many_die_in_the_next_frame(stream):
    frames = inspect_stream(stream).frames

    assert any(frame.births for frame in frames)
    for earlier, later in itertools.pairwise(frames):
        assert later.deaths == earlier.births
    assert {frame.gaussians - frame.births for frame in frames} == {frames[0].gaussians}


def test_with_few_views_a_scene_has_fewer_gaussians(stream):
    canonical = replace(SMALL.canonical, max_gaussians_from_views=8)
    limited = next(decode(_encode(replace(SMALL, canonical=canonical), frames=1)))
    limit = SMALL.canonical.max_gaussians * len(make_capture().training) // 8

    assert limited.count <= limit < next(decode(stream)).count


def test_only_the_requested_number_of_frames_is_encoded():
    assert [scene.frame for scene in decode(_encode(frames=2))] == [0, 1]


def test_a_frame_is_trained_from_the_decoders_previous_state(monkeypatch):
    sink, frame_starts = io.BytesIO(), []
    fit, measure, losses = encode_stream.fit_motion, encode_stream.measure_loss, []
    monkeypatch.setattr(
        encode_stream,
        "measure_loss",
        lambda *arguments: losses.append(measure(*arguments)) or losses[-1],
    )

    def spy(context, start, *fit_arguments):
        frame_starts.append((start.previous, sink.getvalue()))
        return fit(context, start, *fit_arguments)

    monkeypatch.setattr(encode_stream, "fit_motion", spy)
    encode(make_capture(), sink, EncodeOptions(SMALL, device="cpu"))

    assert len(frame_starts) == 3
    for previous_state, written in frame_starts:
        decoded = _decode_complete_frames(written)[-1]
        for field in ("ids", "positions", "rotations", "codes"):
            assert np.array_equal(
                getattr(previous_state.scene, field), getattr(decoded.scene, field)
            )
        assert np.array_equal(previous_state.motion, decoded.motion)


def test_lambda_follows_from_the_file_so_far(monkeypatch):
    config = replace(SMALL, target_kb_per_frame=0.2, rd_lambda=3.0)
    sink, calls = io.BytesIO(), []
    fit, measure, losses = encode_stream.fit_motion, encode_stream.measure_loss, []
    monkeypatch.setattr(
        encode_stream,
        "measure_loss",
        lambda *arguments: losses.append(measure(*arguments)) or losses[-1],
    )

    def spy(*fit_arguments):
        calls.append((fit_arguments[-1], sink.getvalue()))
        return fit(*fit_arguments)

    monkeypatch.setattr(encode_stream, "fit_motion", spy)
    encode(make_capture(), sink, EncodeOptions(config, device="cpu"))

    for rd, written in calls:
        assert rd == RateDistortion(choose_rd_factor(config, _frame_sizes(written)), losses[0])
    assert len({rd for rd, _ in calls}) == len(calls)
    assert len(losses) == 1
    assert 0 < losses[0] < 0.2


def test_the_mean_of_the_frames_meets_its_target(monkeypatch):
    make_original_splats = toys.make_splats
    monkeypatch.setattr(
        toys, "make_splats", lambda frame: make_original_splats(6 * math.sin(frame / 5))
    )
    config = replace(
        SMALL,
        motion=replace(SMALL.motion, iterations=10),
        births=replace(SMALL.births, iterations=0),
        target_kb_per_frame=0.2,
    )

    sink = io.BytesIO()
    encode(make_capture(45), sink, EncodeOptions(config, device="cpu"))

    sizes = _frame_sizes(sink.getvalue())
    assert len(sizes) == 44
    assert np.mean(sizes) == pytest.approx(0.2 * 1024, rel=0.05)


@pytest.mark.parametrize("preset_part", ["paper rules", "no births", "degree 0"])
def test_other_settings_encode_and_decode_too(preset_part):
    changes = {
        "paper rules": replace(
            SMALL,
            stream=replace(SMALL.stream, rotation_components=4),
            motion=replace(
                SMALL.motion,
                rate_model="l1",
                warm_start="anchors",
                level_lr_factor=1.0,
                lr_end_factor=1.0,
            ),
        ),
        "no births": replace(SMALL, births=replace(SMALL.births, iterations=0)),
        "degree 0": replace(SMALL, stream=replace(SMALL.stream, sh_degree=0)),
    }

    summary = inspect_stream(_encode(changes[preset_part], frames=3))

    assert len(summary.frames) == 3
    assert sum(frame.coded_bytes["motion"] for frame in summary.frames) > 0


def test_births_at_errors_are_added_and_only_faint_gaussians_die_for_them():
    births = replace(SMALL.births, placement="errors", error_threshold=0.03, death_opacity=0.05)

    frames = inspect_stream(_encode(replace(SMALL, births=births))).frames

    birth_count = sum(frame.births for frame in frames)
    death_count = sum(frame.deaths for frame in frames)
    assert birth_count > death_count
    assert frames[-1].gaussians == frames[0].gaussians + birth_count - death_count


@pytest.mark.parametrize(
    ("lattice_exponent", "position_step"),
    [pytest.param(21, 4, id="far from parents"), pytest.param(10, 1000, id="off the lattice")],
)
def test_births_that_no_frame_can_represent_are_dropped(lattice_exponent, position_step):
    header = replace(SMALL.stream, lattice_exponent=lattice_exponent, position_step=position_step)
    births = replace(SMALL.births, spread=2e4, prune_radius=1e30, split_iters=())

    frames = inspect_stream(_encode(replace(SMALL, stream=header, births=births), 3)).frames

    assert len(frames) == 3


def test_a_frame_that_cannot_be_coded_is_named():
    config = replace(SMALL, motion=replace(SMALL.motion, lr=1e300))

    with pytest.raises(EncodeError, match=r"^frame 1 of the capture: training diverged"):
        _encode(config, 3)


def test_births_stop_at_the_limit_of_the_level(stream, monkeypatch):
    first_count = inspect_stream(stream).frames[0].gaussians
    limit = first_count + SMALL.births.max_births + 2
    monkeypatch.setitem(LEVELS, 10, LEVELS[10]._replace(gaussians=limit))
    births = replace(SMALL.births, placement="errors", error_threshold=0.0, death_opacity=0.0)

    frames = inspect_stream(_encode(replace(SMALL, births=births))).frames

    assert [frame.gaussians for frame in frames] == [first_count, limit - 2, limit, limit]


@cache
def _make_state():
    """Return a state of 40 Gaussians, which all examples share."""
    return make_stream(gaussian_count=40, frame_count=2)[1][0]


@given(st.integers(0, 60), st.floats(0, 1))
def test_only_surplus_and_faint_gaussians_die(target, death_opacity):
    state = _make_state()

    deaths = count_deaths(state, target, BirthSettings(death_opacity=death_opacity))

    logits = dequantize(state.scene).opacities.astype(np.float64)
    faint_count = sum(1 / (1 + math.exp(-logit)) < death_opacity for logit in logits)
    assert deaths == min(max(0, state.scene.count - target), faint_count)


def test_progress_reports_every_stage():
    reported = []

    class RecordingProgress:
        def advance(self, stage, done, total):
            reported.append((stage, done, total))

    encode(make_capture(), io.BytesIO(), EncodeOptions(SMALL, 2, "cpu", RecordingProgress()))

    assert {stage for stage, _, _ in reported} == {"canonical", "motion", "births", "frames"}
    assert reported[-1] == ("frames", 2, 2)


@pytest.mark.parametrize("frames", [0, 6])
def test_missing_frames_of_the_capture_are_rejected_before_training(frames):
    class UnusedProgress:
        def advance(self, *reported):
            raise AssertionError(reported)

    sink = io.BytesIO()
    with pytest.raises(TooFewFramesError, match=f"{frames} frames are requested, but .* has 5"):
        encode(make_capture(5), sink, EncodeOptions(SMALL, frames, "cpu", UnusedProgress()))
    assert sink.getvalue() == b""


def test_an_interrupted_stream_consists_of_complete_frames(monkeypatch):
    sink = io.BytesIO()
    start = ClosedLoop.start_frame

    def raise_at_frame_2(self, deaths):
        if self.state.scene.frame == 2:
            raise KeyboardInterrupt
        return start(self, deaths)

    monkeypatch.setattr(ClosedLoop, "start_frame", raise_at_frame_2)
    with pytest.raises(KeyboardInterrupt):
        encode(make_capture(), sink, EncodeOptions(SMALL, device="cpu"))

    assert [state.scene.frame for state in _decode_complete_frames(sink.getvalue())] == [0, 1, 2]


def test_every_nth_frame_is_canonical_and_close_to_its_own_pictures():
    capture = make_capture()
    config = replace(SMALL, canonical=replace(SMALL.canonical, keyframe_interval=2))

    frames = inspect_stream(data := _encode(config)).frames
    scenes = list(decode(data))

    assert [frame.canonical for frame in frames] == [True, False, True, False]
    assert frames[2].gaussians == inspect_stream(_encode(frames=3)).frames[2].gaussians
    for frame in (2, 3):
        stale_error = _measure_error(replace(scenes[0], frame=frame), capture)
        assert _measure_error(scenes[frame], capture) < 0.9 * stale_error
