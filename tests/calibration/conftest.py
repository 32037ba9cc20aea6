import pytest

from quarc_ref.calibration.calibrate import CalibrateOptions, calibrate
from quarc_ref.calibration.offsets import SyncMethod
from quarc_ref.calibration.recordings import find_recordings
from quarc_ref.calibration.world import Distance


@pytest.fixture(scope="session")
def rig(traced_rig):
    options = CalibrateOptions(
        sync=SyncMethod.NONE, moment_count=1, distance=Distance("cam01", "cam06", 2.0)
    )
    return calibrate(find_recordings(traced_rig.folder), options)
