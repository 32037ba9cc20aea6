from dataclasses import replace

import numpy as np

from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.engines import choose_engine, use_engine
from quarc_ref.decoder.reconstruct import begin_frame, move
from quarc_ref.encoder.frames.warm_start import initial_residuals
from quarc_ref.encoder.settings.frames import MotionSettings
from quarc_ref.format.records import StreamHeader
from tests.engines import engines
from tests.small_streams import make_gaussians, make_symbols


def _make_two_frames():
    header = StreamHeader(gaussians_per_anchor=3, resample_interval=1)
    frame_start = begin_frame(begin_canonical(header, 0, make_gaussians(header, 60)), 0)
    previous = move(frame_start, make_symbols(frame_start, seed=4))
    return previous, begin_frame(previous, 0)


@engines
def test_kept_anchors_take_over_their_own_symbols(engine):
    with use_engine(engine):
        decoder = choose_engine()
    header = StreamHeader(gaussians_per_anchor=3, resample_interval=2)
    first = decoder.begin_frame(decoder.begin_canonical(header, 0, make_gaussians(header, 60)), 0)
    motion = decoder.write_motion(first, make_symbols(first, seed=4), use_previous=False)
    previous = decoder.decode_motion(first, motion, use_previous=False)

    start = initial_residuals(
        previous,
        decoder.begin_frame(previous, 0),
        MotionSettings(warm_start="anchors", momentum=0.5),
    )

    assert start.T.tolist() == (np.concatenate(previous.symbols, axis=1) * 0.5).tolist()


def test_new_anchors_take_over_the_mean_of_the_nearest_three():
    previous, frame_start = _make_two_frames()

    start = initial_residuals(
        previous, frame_start, MotionSettings(warm_start="anchors", momentum=1.0)
    )

    old, new = previous.required_anchors.levels[0], frame_start.required_anchors.levels[0]
    squared = ((new.positions[:, :, None] - old.positions[:, None]).astype(float) ** 2).sum(0)
    for index in range(new.owners.size):
        third_smallest = np.sort(squared[index])[2]
        if (squared[index] == third_smallest).sum() > 1:
            continue
        nearest = squared[index] <= third_smallest
        assert np.allclose(start[index], previous.symbols[0][:, nearest].mean(axis=1))


def test_a_common_motion_is_projected_onto_the_coarsest_level():
    previous, frame_start = _make_two_frames()
    motion = np.tile(np.arange(1.0, 7.0)[:, None], (1, 60)).astype(np.int64)
    frame_start = replace(frame_start, motion=motion)

    start = initial_residuals(
        previous, frame_start, MotionSettings(warm_start="projection", momentum=1.0)
    )

    sizes = [level.owners.size for level in frame_start.required_anchors.levels]
    assert start[-sizes[2] :].tolist() == [[1, 2, 3, 4, 5, 6]] * sizes[2]
    assert not start[: -sizes[2]].any()


def test_the_first_frame_starts_from_rest():
    header = StreamHeader(gaussians_per_anchor=3)
    canonical = begin_canonical(header, 0, make_gaussians(header, 60))
    frame_start = begin_frame(canonical, 0)

    for rule in ("anchors", "projection"):
        assert not initial_residuals(canonical, frame_start, MotionSettings(warm_start=rule)).any()
