import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

import decode
from moving_stream import Job, write_moving_stream
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.inspection import decode_speed
from quarc_ref.inspection.decode_speed import measure_speed
from quarc_ref.playback.player import Player
from quarc_ref.streams import decode as decode_stream
from quarc_ref.streams.decode_stream import decode_states
from quarc_ref.streams.sources import open_source
from tests.engines import needs_fast


@pytest.fixture(scope="module")
def stream(tmp_path_factory):
    path = tmp_path_factory.mktemp("streams") / "moving.quarc"
    write_moving_stream(path, Job(600, births=5, frames=4))
    return path


def test_a_stream_of_simulated_motion_keeps_its_number_of_gaussians(stream):
    scenes = list(decode_stream(stream.read_bytes()))

    assert [scene.count for scene in scenes] == [600] * 4
    assert scenes[-1].ids[-5:].tolist() == list(range(610, 615))
    assert (scenes[0].positions != scenes[1].positions).any()


@pytest.mark.parametrize("threads", [1, 2])
def test_a_stream_is_measured(stream, threads):
    speed = measure_speed(str(stream), threads)

    assert (speed.frames, speed.gaussians, speed.threads) == (4, 600, threads)
    assert speed.fps > 0
    assert 0 < speed.first_frame_s < 60
    assert 0 < speed.warm_first_frame_s < 60
    assert speed.peak_rss_mib > 10
    assert speed.stolen_share is None or 0 <= speed.stolen_share < 1
    assert speed.ms_by_stage.keys() == {"decode", "floats"}


class _PlayerAtStatedTimes:
    """Plays frames of 600 Gaussians, of which the first takes 9 ms to decode, and others 2 ms."""

    def __init__(self, _source, **_options):
        self.times = {"decode": 0}

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def __iter__(self):
        for milliseconds in (9, 2, 2, 2):
            self.times["decode"] += milliseconds * 1_000_000
            yield SimpleNamespace(splats=SimpleNamespace(opacities=[0.0] * 600))


def test_speeds_are_those_of_the_frames_after_the_first(stream, monkeypatch):
    seconds = iter([10.0, 12.0, 12.5, 13.0, 13.5, 20.0, 20.25])  # the last two: opened again
    cpu_seconds = iter([5.0, 5.75])
    clock = SimpleNamespace(
        perf_counter=lambda: next(seconds), process_time=lambda: next(cpu_seconds)
    )
    monkeypatch.setattr(decode_speed, "time", clock)
    monkeypatch.setattr(decode_speed, "Player", _PlayerAtStatedTimes)
    speed = measure_speed(str(stream), 1)

    assert (speed.frames, speed.gaussians) == (4, 600)
    assert (speed.fps, speed.cpu_ms, speed.ms_by_stage) == (2, 250, {"decode": 2})
    assert (speed.first_frame_s, speed.warm_first_frame_s) == (2, 0.25)


def test_a_stage_done_before_the_first_frame_is_still_listed(stream, monkeypatch):
    class PlayerThatDecodesAhead(Player):
        def __iter__(self):
            yield from list(super().__iter__())

    monkeypatch.setattr(decode_speed, "Player", PlayerThatDecodesAhead)

    assert measure_speed(str(stream), 2).ms_by_stage == {"decode": 0, "floats": 0}


@needs_fast
def test_the_number_of_threads_changes_no_state(tmp_path):
    path = tmp_path / "wide.quarc"
    write_moving_stream(path, Job(40_000, births=50, frames=6))  # enough for several threads

    def list_digests(threads):
        with open_source(str(path)) as source, Player(source, threads=threads) as player:
            return [compute_digest(frame.scene) for frame in player]

    assert list_digests(1) == list_digests(3)


def test_a_sparse_stream_has_about_as_many_followers_of_moving_anchors_as_real_streams(tmp_path):
    path = tmp_path / "sparse.quarc"
    write_moving_stream(path, Job(20_000, births=5, frames=2, sparse=True))

    _, moved_state = decode_states(path.read_bytes())

    moving_shares = [
        level_symbols.any(axis=0)[binding].mean()
        for level_symbols, binding in zip(
            moved_state.symbols, moved_state.anchors.binding, strict=True
        )
    ]
    assert moving_shares == pytest.approx([0.10, 0.25, 0.45], abs=0.08)


def test_a_stream_is_made_once(tmp_path):
    job = Job(50, births=1, frames=2)

    path = decode.make_stream(job, tmp_path)
    modified_ns = path.stat().st_mtime_ns

    assert decode.make_stream(job, tmp_path).stat().st_mtime_ns == modified_ns


@pytest.mark.parametrize("change", [{"updated_share": 0.0004}, {"births": 2}, {"sparse": True}])
def test_streams_of_different_jobs_have_different_files(tmp_path, change):
    job = Job(50, births=1, frames=2)

    assert decode.make_stream(job, tmp_path) != decode.make_stream(replace(job, **change), tmp_path)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ("--frames 1", "--frames must be at least 2"),
        ("--updated 2", "--updated a number from 0 to 1"),
        ("--gaussians 100", "--births must be at most"),
        ("--table --threads 1", "--threads cannot be combined with --table"),
    ],
)
def test_impossible_options_are_rejected(monkeypatch, capsys, options, message):
    monkeypatch.setattr(sys, "argv", ["decode.py", *options.split()])
    monkeypatch.setattr(decode, "make_stream", None)  # is not called

    with pytest.raises(SystemExit):
        decode.main()
    assert message in capsys.readouterr().err


def test_the_table_has_a_row_for_each_measurement(stream):
    rows = [measure_speed(str(stream), threads).as_json() for threads in (1, 2)]

    lines = decode.format_table(rows).splitlines()

    assert len(lines) == 4
    assert len({line.count("|") for line in lines}) == 1


def test_the_requested_share_of_gaussians_is_updated(tmp_path):
    path = tmp_path / "updated.quarc"

    write_moving_stream(path, Job(600, births=5, frames=4, updated_share=0.1))

    states = list(decode_states(path.read_bytes()))[1:]
    assert all(30 < state.updates.count < 90 for state in states)
