from dataclasses import replace

from plain import spec_text
from quarc_ref import __version__
from quarc_ref.encoder.description import describe_encode
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.frames import MotionSettings
from tests.encoder.toys import make_capture


def test_a_stream_names_its_source_and_encoder():
    metadata = describe_encode(make_capture(), EncoderConfig(), "cpu")

    assert metadata["capture"] == "toy"
    assert metadata["fingerprint"] == "0" * 64
    assert metadata["encoder"].startswith(f"quarc-ref {__version__}, numba ")
    assert "torch" in metadata["encoder"]


def test_every_changed_setting_is_recorded():
    config = replace(EncoderConfig(seed=7), motion=MotionSettings(lr=0.25))

    assert describe_encode(make_capture(), EncoderConfig(), "cpu")["settings"] == ""
    settings = describe_encode(make_capture(), config, "cpu")["settings"].split()
    assert settings == ["motion.lr=0.25", "seed=7"]


def test_every_key_is_registered():
    rows = spec_text.read_table(spec_text.read_spec(), "metadata")
    registered_keys = {key for names, _ in rows for key in names.split(", ")}

    capture = make_capture()
    capture.start = 7

    metadata = describe_encode(capture, EncoderConfig(), "cpu")

    assert metadata["start"] == "7"
    assert metadata.keys() <= registered_keys
