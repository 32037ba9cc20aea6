"""Profiles of hypothesis, and fixtures that all tests share."""

import os
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, settings

from quarc_ref.decoder.reference_engine import ReferenceEngine
from quarc_ref.format.coding.entropy import use_bit_decoder
from quarc_ref.inspection.cross_check import CrossChecker
from tests.clusters import run_cluster

settings.register_profile("quick", max_examples=20, deadline=None)
settings.register_profile("dev", max_examples=50, deadline=None)
settings.register_profile(
    "ci",
    max_examples=50,
    deadline=None,
    derandomize=True,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("thorough", max_examples=5000, deadline=None)

# Threads that wait do not spin: the workers of xdist share the processors.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

# A shell that runs tests in the background makes them ignore SIGINT.
signal.signal(signal.SIGINT, signal.default_int_handler)

_DEFAULT_CAPTURE = Path(__file__).resolve().parents[2] / "shared" / "data" / "panoptic_basketball"


@pytest.fixture(autouse=True, scope="session")
def _use_temporary_cache(tmp_path_factory):
    """Write triangulated points into a temporary cache instead of the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


# Folders of tests in which every section is decoded with both entropy decoders.
_BIT_TEST_FOLDERS = {"conformance", "format", "hostile", "inspection"}

# These run first, in this order. Of the first two processes, one compiles the kernels of the
# renderer and the trainer. The other compiles those of the synthetic scene, and then runs the third
# file, which needs no kernels, until the first is done: no process compiles what another does.
_FIRST_FILES = (
    "benchmarks/test_ladder.py",
    "calibration/test_calibrate.py",
    "conformance/test_both_engines.py",
)


def pytest_addoption(parser):
    parser.addoption(
        "--thorough",
        action="store_true",
        help="run the tests marked thorough, too, and decode every section of every test with "
        "both entropy decoders (make check)",
    )


def pytest_configure(config):
    """Choose the profile of hypothesis from the environment, or a larger one with --thorough."""
    profile = "dev" if config.getoption("--thorough") else "quick"
    settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", profile))


def pytest_collection_modifyitems(config, items):
    """Begin with the files that compile kernels; skip the thorough tests without --thorough."""
    items.sort(key=_rank_file)
    if config.getoption("--thorough"):
        return
    thorough = [item for item in items if item.get_closest_marker("thorough")]
    config.hook.pytest_deselected(items=thorough)
    items[:] = [item for item in items if not item.get_closest_marker("thorough")]


def _rank_file(item):
    name = item.path.relative_to(Path(__file__).parent).as_posix()
    return _FIRST_FILES.index(name) if name in _FIRST_FILES else len(_FIRST_FILES)


@pytest.fixture
def both_entropy_decoders():
    """Decode every section with both entropy decoders, which must return the same bits."""
    cross_checker = CrossChecker()
    with use_bit_decoder(cross_checker.make_decoder):
        yield cross_checker


@pytest.fixture(autouse=True)
def _forget_large_scenes(monkeypatch):
    """Without a fast engine, keep the hint at it out of tests that decode no large scene."""
    monkeypatch.setattr(ReferenceEngine, "largest_gaussian_count", 0)


@pytest.fixture(autouse=True)
def _cross_check(request):
    """Use both entropy decoders in the listed folders, and in all tests with --thorough."""
    is_bit_test = request.path.relative_to(Path(__file__).parent).parts[0] in _BIT_TEST_FOLDERS
    if is_bit_test or request.config.getoption("--thorough"):
        request.getfixturevalue("both_entropy_decoders")


@pytest.fixture(scope="session")
def traced_rig(tmp_path_factory):
    """The folder with videos of seven neighboring cameras of a traced rig, and the cameras."""
    from tests.recordings import write_recordings  # imports numba

    folder = tmp_path_factory.mktemp("traced") / "bare"
    return SimpleNamespace(cameras=write_recordings(folder, camera_count=7), folder=folder)


@pytest.fixture(scope="session")
def ray_cluster():
    """The address of a Ray cluster of two processors."""
    yield from run_cluster()


@pytest.fixture(scope="session")
def real_capture() -> Path:
    """The folder of a real capture, which is not part of the repository."""
    folder = Path(os.environ.get("QUARC_CAPTURE", _DEFAULT_CAPTURE))
    if not folder.is_dir():
        pytest.skip("no real capture: set QUARC_CAPTURE to panoptic_basketball in N3DV's layout")
    return folder
