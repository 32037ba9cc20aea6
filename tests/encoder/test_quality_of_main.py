"""The preset `main`, with fewer iterations and Gaussians, keeps its quality and its bytes.

The bounds are at least three standard deviations of ten seeds from their mean: 33.5 dB +- 0.2,
SSIM 0.962 +- 0.001, 38 400 +- 400 bytes for the canonical frame, and 1180 +- 40 bytes for each
later frame. Another processor is like another seed. A change that leaves the bounds on purpose
moves them.
"""

import io

import pytest

from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.settings.presets import change_settings, choose_preset
from quarc_ref.evaluation.evaluate import evaluate_stream
from quarc_ref.synth import SynthOptions, write_synthetic_capture

_FRAMES = 4
_SHORTER = {  # a fifth of the iterations of frame 0, with all stages of `main`
    "canonical.iterations": "800",
    "canonical.densify_from_iter": "60",
    "canonical.half_resolution_until_iter": "460",
    "canonical.densify_until_iter": "540",
    "canonical.initial_gaussians": "4000",
    "canonical.max_gaussians": "8000",
    "canonical.max_gaussians_from_views": "0",
    "motion.iterations": "100",
}


@pytest.fixture(scope="module")
def evaluation(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quality") / "playroom"
    write_synthetic_capture(folder, SynthOptions(160, 120, frames=_FRAMES, cameras=12))
    config = change_settings(choose_preset("main"), _SHORTER.items())
    stream = io.BytesIO()
    capture = open_capture(folder, CaptureOptions(held_out=("cam00",)))
    encode(capture, stream, EncodeOptions(config, device="cpu", checks=False))
    return evaluate_stream(stream.getvalue(), folder, lambda *_: None)


def test_held_out_cameras_look_as_good_as_before(evaluation):
    assert evaluation.quality.mean()["psnr"] > 32.9
    assert evaluation.quality.mean()["ssim"] > 0.957


def test_the_canonical_frame_takes_as_many_bytes_as_before(evaluation):
    assert 36_900 < evaluation.summary.coded_bytes()["canonical"] < 39_900


def test_later_frames_take_as_many_bytes_as_before(evaluation):
    coded_bytes = evaluation.summary.coded_bytes()
    later_bytes = sum(coded_bytes[kind] for kind in ("motion", "updates", "births"))
    assert 1040 < later_bytes / (_FRAMES - 1) < 1330
