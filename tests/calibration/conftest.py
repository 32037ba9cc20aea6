from types import SimpleNamespace

import pytest

from quarc_ref.calibration.calibrate import CalibrateOptions, calibrate
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.calibration.world import Distance
from tests.recordings import write_recordings


@pytest.fixture(scope="session")
def traced_rig(tmp_path_factory):
    """The folder with videos of a ray-traced rig, and the true cameras of the rig."""
    folder = tmp_path_factory.mktemp("traced") / "bare"
    return SimpleNamespace(cameras=write_recordings(folder), folder=folder)


@pytest.fixture(scope="session")
def rig(traced_rig):
    options = CalibrateOptions(
        sync=SyncMethod.NONE, moment_count=1, distance=Distance("cam01", "cam12", 2.0)
    )
    return calibrate(find_recordings(traced_rig.folder), options)
