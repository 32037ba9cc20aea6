"""Files that are not a valid checkpoint of this training are ignored."""

import os
import subprocess
import sys
import zipfile
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.encoder.resume import checkpoint
from quarc_ref.encoder.resume.array_file import write_arrays
from quarc_ref.encoder.resume.checkpoint import Checkpoint
from quarc_ref.encoder.settings.config import make_header
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import Observers
from tests.encoder.resume.saved import read_checkpoint_arrays
from tests.encoder.toys import SMALL, make_capture, make_context

_CONFIG = replace(
    SMALL.canonical, iterations=12, densify_from_iter=4, densify_until_iter=9, exposure_lr=0.2,
    exposure_from_iter=5, sh_from_iter=6,
)  # fmt: skip
_LAST_STEP = 8
_ENSEMBLE = replace(_CONFIG, ensemble_size=3, pseudo_views_from=0.25, pseudo_view_ratio=0.5)


class _StoppedError(Exception):
    pass


class _StoppingProgress:
    """Progress that records the first step, and stops the training after step `last`."""

    def __init__(self, last=None):
        self.first = None
        self._last = last

    def advance(self, _stage, process, _total):
        self.first = self.first or process
        if process == self._last:
            raise _StoppedError


def _train(path, last=None, config=_CONFIG):
    """Train with a checkpoint; return the attributes and the first step of the training."""
    steps = _StoppingProgress(last)
    context = replace(make_context(), observers=Observers(steps))
    header = make_header(SMALL, 30.0, 160)
    trained = train_canonical(
        context,
        make_capture().points,
        CanonicalObjective(config, header),
        Checkpoint(path, {"name": "toy"}),
    )
    return trained, steps.first


@pytest.fixture(autouse=True)
def _save_every_step(monkeypatch):
    monkeypatch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """The path and the arrays of the checkpoint of a stopped training."""
    path = tmp_path_factory.mktemp("training") / "saved"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 0.0)
        with pytest.raises(_StoppedError):
            _train(path, _LAST_STEP)
    return path, read_checkpoint_arrays(path)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 1e9)
        return _train(tmp_path_factory.mktemp("unbroken") / "none")[0]


def _plant(path, saved, changes):
    key = Checkpoint(path, {"name": "toy"})._key
    arrays = {name: array for name, array in (saved | changes).items() if array is not None}
    with path.open("wb") as file:
        write_arrays(file, key, arrays)


def _are_equal(first, second):
    return all(map(np.array_equal, first.tensors(), second.tensors()))


def test_a_saved_training_is_resumed(saved, uninterrupted, tmp_path):
    _plant(tmp_path / "a", saved[1], {})
    trained, first_step = _train(tmp_path / "a")

    assert first_step == _LAST_STEP + 1
    assert _are_equal(trained, uninterrupted)


def _ones(*shape, dtype=np.float32):
    return np.ones(shape, dtype)


_CHANGES = {
    "no name": {"sums": None},
    "one name more": {"more": _ones(3)},
    "fewer rows": {"means": _ones(3, 3)},
    "fewer rows of Adam": {"means.exp_avg": _ones(3, 3)},
    "doubles": {"means": _ones(103, 3, dtype=np.float64)},
    "complex numbers": {"means": _ones(103, 3, dtype=np.complex64)},
    "text": {"means": np.full((103, 3), "a")},
    "a step that is text": {"step": np.array("3")},
    "a step that is a list": {"step": np.array([3])},
    "a step before the first": {"step": np.array(-1)},
    "a step after the last": {"step": np.array(13)},
    "an unknown view": {"left": np.array([99])},
    "a view below 0": {"left": np.array([-1])},
    "too many views": {"left": np.zeros(1000, np.int64)},
    "views in a table": {"left": np.zeros((1, 1), np.int64)},
    "another generator": {"generator": np.zeros(5056, np.uint8)},
    "a short generator": {"generator": np.zeros(16, np.uint8)},
    "gains of other views": {"gains": _ones(9, 3)},
}


@pytest.mark.parametrize("changes", _CHANGES.values(), ids=_CHANGES)
def test_invalid_arrays_restart_the_training(changes, saved, uninterrupted, tmp_path):
    _plant(tmp_path / "a", saved[1], changes)
    trained, first_step = _train(tmp_path / "a")

    assert first_step == 1
    assert _are_equal(trained, uninterrupted)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("name", ["means", "gains", "log_scales.exp_avg_sq", "sums"])
def test_numbers_that_are_not_finite_restart_the_training(name, value, saved, tmp_path):
    corrupted = saved[1][name].copy()
    corrupted.flat[-1] = value
    _plant(tmp_path / "a", saved[1], {name: corrupted})

    assert _train(tmp_path / "a")[1] == 1


def test_a_negative_mean_square_restarts_the_training(saved, tmp_path):
    _plant(tmp_path / "a", saved[1], {"means.exp_avg_sq": -saved[1]["means.exp_avg_sq"]})

    assert _train(tmp_path / "a")[1] == 1


@pytest.mark.parametrize("kind", ["link", "folder", "pipe"])
def test_anything_but_a_regular_file_is_ignored(kind, saved, tmp_path):
    path, victim = tmp_path / "a", tmp_path / "victim"
    victim.write_bytes(saved[0].read_bytes())
    if kind == "link":
        path.symlink_to(victim)
    elif kind == "pipe":
        os.mkfifo(path)
    else:
        path.mkdir()
    loaded = Checkpoint(path, {"name": "toy"}).load(None)

    assert loaded is None
    if kind == "link":
        assert _train(path)[1] == 1
        assert victim.read_bytes() == saved[0].read_bytes()


def test_a_bomb_is_not_inflated(tmp_path):
    """A NumPy archive of half a MB that would inflate to 500 MB of zeros is rejected."""
    path = tmp_path / "a"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("means.npy", "w", force_zip64=True) as member,
    ):
        np.lib.format.write_array_header_1_0(
            member, {"descr": "|u1", "fortran_order": False, "shape": (500 << 20,)}
        )
        for _ in range(500):
            member.write(bytes(1 << 20))
    program = (
        "import sys, resource; from pathlib import Path\n"
        "from quarc_ref.encoder.resume.checkpoint import Checkpoint\n"
        "kept = Checkpoint(Path(sys.argv[1]), {'name': 'toy'})\n"
        "before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss\n"
        "assert kept.load(None) is None\n"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)"
    )
    process = subprocess.run([sys.executable, "-c", program, path], capture_output=True, check=True)

    assert int(process.stdout) < 16 << 10  # KiB


@pytest.fixture(scope="module")
def uninterrupted_ensemble(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(checkpoint, "_SAVE_INTERVAL_SECONDS", 1e9)
        return _train(tmp_path_factory.mktemp("ensemble") / "none", config=_ENSEMBLE)[0]


@pytest.mark.parametrize("last", [1, 3, 4, 6, 7, 9, 10, 14, 18])
def test_an_ensemble_is_resumed_in_any_of_its_scenes(last, uninterrupted_ensemble, tmp_path):
    with pytest.raises(_StoppedError):
        _train(tmp_path / "a", last, _ENSEMBLE)
    trained, first_step = _train(tmp_path / "a", config=_ENSEMBLE)

    assert first_step == (last + 1 if last < _ENSEMBLE.training_steps else None)
    assert _are_equal(trained, uninterrupted_ensemble)


@pytest.mark.parametrize(
    ("last", "changes"),
    [
        (5, {"step": 2}),
        (5, {"step": 8}),
        (12, {"step": 8}),
        (12, {"step": 19}),
        (12, {"scene 2": 0}),
        (12, {"scene 0": 0}),
        (12, {"scene 1": 200}),
        (12, {"scene 3": 1}),
    ],
    ids=str,
)
def test_an_ensemble_that_does_not_fit_its_step_restarts_the_training(
    last, changes, uninterrupted_ensemble, tmp_path
):
    with pytest.raises(_StoppedError):
        _train(tmp_path / "a", last, _ENSEMBLE)
    arrays = read_checkpoint_arrays(tmp_path / "a")
    for name, value in changes.items():
        if name == "step":
            arrays["step"] = np.array(value)
            continue
        for array_name, array in list(arrays.items()):
            if array_name.startswith("scene 0."):
                changed_name = array_name.replace("scene 0", name)
                arrays[changed_name] = np.resize(array, (value, *array.shape[1:]))
    _plant(tmp_path / "a", arrays, {})
    trained, first_step = _train(tmp_path / "a", config=_ENSEMBLE)

    assert first_step == 1
    assert _are_equal(trained, uninterrupted_ensemble)
