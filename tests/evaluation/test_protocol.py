import json
from importlib.metadata import version

import pytest

from quarc_ref.evaluation.evaluate import EvaluationOptions, evaluate_stream
from quarc_ref.evaluation.protocol import make_protocol
from quarc_ref.evaluation.report import write_report
from quarc_ref.evaluation.same_capture import OtherCaptureError
from quarc_ref.files import written_folder
from tests.evaluation.capture_streams import write_stream
from tests.evaluation.conftest import ignore_progress


@pytest.fixture(scope="module")
def protocol(evaluation):
    return evaluation.protocol.as_json()


def test_the_protocol_lists_everything_that_affects_a_figure(protocol, capture):
    assert protocol["fingerprint"] == capture.fingerprint
    assert protocol["cameras"] == {"training": ["cam00", "cam03"], "held_out": ["cam01", "cam04"]}
    assert protocol["resolution"] == [48, 32]
    assert (protocol["first_frame"], protocol["frames"]) == (0, 4)
    assert protocol["seed"] == 5
    assert "numba" in protocol["renderer"]
    assert "ssim_inria" in protocol["metrics"]["ssim"]
    assert "averaged over frames" in protocol["metrics"]["psnr"]


def test_the_versions_are_those_installed(protocol):
    for package in ("numpy", "numba", "torch"):
        assert protocol["versions"][package] == version(package)
    assert protocol["versions"]["format"] == "1.1"


def test_the_protocol_is_json(protocol):
    assert json.loads(json.dumps(protocol)) == protocol


def test_the_capture_that_a_stream_names_is_compared(folder, capture):
    data = write_stream(capture.cameras, 1, {"fingerprint": capture.fingerprint})
    measured = evaluate_stream(data, folder, ignore_progress).protocol

    assert measured.encoded_from == capture.fingerprint
    assert measured.as_texts()["encoded from"] == "this capture"
    assert measured.is_same_capture is True


def test_a_stream_of_another_capture_is_measured_only_on_request(folder, capture):
    data = write_stream(capture.cameras, 1, {"fingerprint": "f" * 64})

    with pytest.raises(OtherCaptureError, match="another capture") as rejected:
        evaluate_stream(data, folder, ignore_progress)
    measured = evaluate_stream(
        data, folder, ignore_progress, EvaluationOptions(accept_other_capture=True)
    ).protocol

    assert (rejected.value.fingerprint, rejected.value.encoded_from) == (
        capture.fingerprint,
        "f" * 64,
    )
    assert measured.encoded_from == measured.as_texts()["encoded from"] == "f" * 64
    assert measured.is_same_capture is False


def test_a_stream_that_names_no_capture_is_reported(capture):
    protocol = make_protocol(capture, capture.cameras, range(4), 0, None)

    assert protocol.as_texts()["encoded from"] == "unknown: the stream has no fingerprint"
    assert protocol.is_same_capture is None


def test_the_page_shows_the_protocol(evaluation, capture, tmp_path):
    with written_folder(tmp_path / "report") as output:
        page = write_report(evaluation, output).read_text("utf-8")

    assert capture.fingerprint in page
    assert "held-out cameras: cam01, cam04" in page
