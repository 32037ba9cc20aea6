"""A tiny capture that several tests share; tests must not modify it."""

import pytest

from quarc_ref.synth.options import SynthOptions
from quarc_ref.synth.write_capture import write_synthetic_capture


@pytest.fixture(scope="session")
def options():
    return SynthOptions(width=48, height=36, frames=3, cameras=4)


@pytest.fixture(scope="session")
def folder(tmp_path_factory, options):
    folder = tmp_path_factory.mktemp("synth") / "playroom"
    write_synthetic_capture(folder, options)
    return folder
