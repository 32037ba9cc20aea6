from types import SimpleNamespace

import pytest

from quarc_ref.calibration.calibrate import CalibrateOptions, calibrate
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.calibration.world import Distance
from tests.recordings import write_recordings


@pytest.fixture(scope="session")
def traced(tmp_path_factory):
    """Videos of a traced rig without poses, and its true cameras."""
    folder = tmp_path_factory.mktemp("traced") / "bare"
    return SimpleNamespace(true=write_recordings(folder), folder=folder)


@pytest.fixture(scope="session")
def rig(traced):
    options = CalibrateOptions(
        sync=SyncMethod.NONE, moments=1, distance=Distance("cam01", "cam12", 2.0)
    )
    return calibrate(find_recordings(traced.folder), options)
