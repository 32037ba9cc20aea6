"""Profiles of hypothesis, and common fixtures."""

import os
import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from quarc_ref.format.coding.entropy import use_bit_decoder
from quarc_ref.inspection.cross_check import CrossCheckingDecoder
from tests.clusters import run_cluster

settings.register_profile("quick", max_examples=20, deadline=None)
settings.register_profile("dev", max_examples=50, deadline=None)
settings.register_profile(
    "ci",
    max_examples=200,
    deadline=None,
    derandomize=True,
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("thorough", max_examples=5000, deadline=None)

# Tests in the background may have inherited a setting to ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)

_BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data" / "panoptic_basketball"


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory):
    """Keep triangulated points out of the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


# Folders of tests of bits: every section is decoded with both decoders.
_ABOUT_BITS = {"conformance", "format", "hostile", "inspection"}


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
    """Skip the tests marked thorough, unless --thorough is given."""
    if config.getoption("--thorough"):
        return
    thorough = [item for item in items if item.get_closest_marker("thorough")]
    config.hook.pytest_deselected(items=thorough)
    items[:] = [item for item in items if not item.get_closest_marker("thorough")]


@pytest.fixture
def both_entropy_decoders():
    """Decode every section with both decoders, which must agree."""
    coders = CrossCheckingDecoder()
    with use_bit_decoder(coders.open):
        yield coders


@pytest.fixture(autouse=True)
def _cross_check(request):
    """Use both decoders in tests of bits, and everywhere with --thorough."""
    about_bits = request.path.relative_to(Path(__file__).parent).parts[0] in _ABOUT_BITS
    if about_bits or request.config.getoption("--thorough"):
        request.getfixturevalue("both_entropy_decoders")


@pytest.fixture(scope="session")
def ray_cluster():
    """The address of a Ray cluster of two processors."""
    yield from run_cluster()


@pytest.fixture(scope="session")
def real_capture() -> Path:
    """The folder of a real capture, which may not be published."""
    folder = Path(os.environ.get("QUARC_CAPTURE", _BESIDE))
    if not folder.is_dir():
        pytest.skip("no real capture: set QUARC_CAPTURE to a folder in N3DV's layout")
    return folder
