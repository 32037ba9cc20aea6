import io
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.resume import checkpoint
from quarc_ref.encoder.resume.array_file import Layout, write_arrays
from quarc_ref.encoder.resume.checkpoint import Checkpoint, checkpoint_path
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.format.errors import ResumeError
from tests.encoder.toys import SMALL, make_capture

_CONFIG = replace(
    SMALL,
    canonical=replace(
        SMALL.canonical,
        iterations=60,
        half_resolution_until_iter=15,
        position_noise=0.003,
        exposure_lr=0.2,
        exposure_from_iter=5,
        prune_rd_lambda=0.1,
        code_rd_lambda=1e-4,
        quantize_rd_lambda=0.01,
        opacity_reg=0.01,
        lr_end_factor=0.05,
    ),
)


class _InterruptedProgress:
    """Progress that raises KeyboardInterrupt after a training step of frame 0."""

    def __init__(self, step):
        self._step = step
        self.first = None

    def advance(self, stage, done, _total):
        if stage == "canonical":
            self.first = self.first or done
            if done == self._step:
                raise KeyboardInterrupt


def _options(step=None, config=_CONFIG):
    return EncodeOptions(config, 1, "cpu", _InterruptedProgress(step))


@pytest.fixture(scope="module")
def uninterrupted():
    sink = io.BytesIO()
    encode(make_capture(), sink, _options())
    return sink.getvalue()


@pytest.fixture(autouse=True)
def _save_every_step(monkeypatch):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)


def _interrupt(path, step):
    with pytest.raises(KeyboardInterrupt):
        encode_file(make_capture(), path, _options(step))


@pytest.mark.parametrize("step", [1, 15, 25, 48, 54, 60])
def test_an_interrupted_training_gives_the_same_bytes(step, tmp_path, uninterrupted):
    path = tmp_path / "toy.quarc"
    _interrupt(path, step)
    options = _options()

    encode_file(make_capture(), path, options)

    assert path.read_bytes() == uninterrupted
    assert options.progress.first == (step + 1 if step < 60 else None)
    assert [entry.name for entry in tmp_path.iterdir()] == ["toy.quarc"]


def test_a_training_interrupted_twice_gives_the_same_bytes(tmp_path, uninterrupted):
    path = tmp_path / "toy.quarc"
    _interrupt(path, 12)
    _interrupt(path, 40)

    encode_file(make_capture(), path, _options())

    assert path.read_bytes() == uninterrupted


def _cut(file):
    file.write_bytes(file.read_bytes()[:-100])


def _flip(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(data)


def _empty(file):
    file.write_bytes(b"")


def _put_other(file):
    with file.open("wb") as sink:
        write_arrays(sink, "other", {"step": np.array(3)})


def _put_text(file):
    file.write_text("no archive")


@pytest.mark.parametrize("damage", [_cut, _flip, _empty, _put_other, _put_text])
def test_an_incomplete_or_foreign_file_is_ignored(damage, tmp_path, uninterrupted):
    path = tmp_path / "toy.quarc"
    _interrupt(path, 30)
    damage(checkpoint_path(path))
    options = _options()

    encode_file(make_capture(), path, options)

    assert path.read_bytes() == uninterrupted
    assert options.progress.first == 1
    assert not checkpoint_path(path).exists()


@pytest.mark.parametrize(
    ("config", "name"),
    [
        (replace(_CONFIG, seed=1), "seed"),
        (
            replace(_CONFIG, canonical=replace(_CONFIG.canonical, iterations=61)),
            "canonical.iterations",
        ),
    ],
    ids=["seed", "iterations"],
)
def test_a_training_with_other_settings_is_not_lost(config, name, tmp_path):
    path = tmp_path / "toy.quarc"
    _interrupt(path, 30)
    saved_bytes = checkpoint_path(path).read_bytes()

    with pytest.raises(ResumeError, match=f"these differ: {name};"):
        encode_file(make_capture(), path, _options(config=config))

    assert checkpoint_path(path).read_bytes() == saved_bytes


def test_a_training_with_other_cameras_is_not_lost(tmp_path):
    path = tmp_path / "toy.quarc"
    _interrupt(path, 30)
    saved_bytes, capture = checkpoint_path(path).read_bytes(), make_capture()
    last = replace(capture.cameras[-1], held_out=True)
    capture.cameras = (*capture.cameras[:-1], last)

    with pytest.raises(ResumeError, match=r"cameras \(--downscale, --held-out\);"):
        encode_file(capture, path, _options())

    assert checkpoint_path(path).read_bytes() == saved_bytes


@pytest.mark.parametrize("key", ["other", "3", "[1]", '{"seed": 3}', "["])
def test_a_key_without_metadata_is_ignored(key, tmp_path):
    with (tmp_path / "kept").open("wb") as sink:
        write_arrays(sink, key, {"step": np.array(3)})

    assert Checkpoint(tmp_path / "kept", {"name": "this"}).load(Layout({}, {})) is None


def test_a_file_is_rewritten_after_a_minute(tmp_path, monkeypatch):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 60.0)
    now = [0.0]
    monkeypatch.setattr(checkpoint.time, "monotonic", lambda: now[0])
    saved_training = Checkpoint(tmp_path / "kept", {"name": "this"})
    loaded_times = []
    for now[0] in (0.0, 59.0, 60.0, 61.0, 119.0, 121.0):
        saved_training.save_if_due(lambda: {"now": np.array(now[0])})
        loaded = saved_training.load(Layout({"now": ("<f8", ())}, {}))
        loaded_times.append(None if loaded is None else float(loaded["now"]))

    assert loaded_times == [None, None, 60.0, 60.0, 60.0, 121.0]


def test_temporary_files_of_a_killed_process_are_removed(tmp_path):
    pytest.importorskip("fcntl")
    saved_training = Checkpoint(tmp_path / "kept", {"name": "this"})
    saved_training.save_if_due(dict)
    (tmp_path / ".kept.0123456789abcdef.part").touch()

    saved_training.remove()

    assert list(tmp_path.iterdir()) == []


def test_a_file_survives_a_power_failure(tmp_path, monkeypatch):
    synced = []
    monkeypatch.setattr("os.fsync", lambda _: synced.append((tmp_path / "kept").exists()))
    Checkpoint(tmp_path / "kept", {"name": "this"}).save_if_due(dict)

    assert synced == [False, True]
