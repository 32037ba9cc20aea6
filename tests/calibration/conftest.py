from types import SimpleNamespace

import pytest

from tests.recordings import write_recordings


@pytest.fixture(scope="session")
def traced(tmp_path_factory):
    """Bare videos of a traced rig, and its true cameras."""
    folder = tmp_path_factory.mktemp("traced") / "bare"
    return SimpleNamespace(true=write_recordings(folder), folder=folder)
