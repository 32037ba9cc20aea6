import socket
import urllib.request
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.viewing.vantage import find_up, stand_at
from tests.small_streams import CAMERA, make_stream

pytest.importorskip("viser")

from quarc_ref.viewing.page import Page, Program
from quarc_ref.viewing.playback import Playback
from quarc_ref.viewing.splat_frame import make_splats

_CAMERAS = (CAMERA, replace(CAMERA, name="cam01", translation=(0.5, 0.0, 2.0)))


@pytest.fixture(scope="module")
def shown():
    return [make_splats(dequantize(state.scene), 0.5) for state in make_stream(frame_count=2)[1]]


@pytest.fixture
def page():
    up = find_up(_CAMERAS, 0)
    nowhere = np.zeros((0, 3), dtype=np.float32)
    vantages = {camera.name: stand_at(camera, up, nowhere) for camera in _CAMERAS}
    chart = (np.array([1.0]), np.array([2.5]))
    program = Program("toy.quarc", range(2), chart, vantages, up)
    with Page(program, ("127.0.0.1", 8080)) as page:
        yield page


def _has_ipv6():
    with suppress(OSError), socket.socket(socket.AF_INET6) as probe:
        probe.bind(("::1", 0))
        return True
    return False


def test_a_page_is_served_where_it_says(page):
    with urllib.request.urlopen(page.url, timeout=30) as answer:
        assert answer.status == 200
        assert b"<html" in answer.read().lower()
    assert page.url.startswith("http://127.0.0.1:")
    assert not page.has_viewers


_BARE = Program("toy.quarc", range(2), (np.zeros(0), np.zeros(0)), {}, np.array([0, 0, 1.0]))


def test_a_second_page_has_a_port_of_its_own(page):
    with Page(_BARE, ("127.0.0.1", 8080)) as other:
        assert other.url != page.url


@pytest.mark.skipif(not _has_ipv6(), reason="no IPv6 here")
def test_a_page_with_an_address_of_ipv6_is_served_where_it_says():
    with Page(_BARE, ("::1", 8080)) as page:
        assert page.url.startswith("http://[::1]:")
        with urllib.request.urlopen(page.url, timeout=30) as answer:
            assert answer.status == 200


def test_nothing_is_written_to_standard_output(page, capsys):
    page.show_playing(on=True)

    assert capsys.readouterr().out == ""


def test_frames_follow_one_another_in_one_place(page, shown):
    for frame, splats in enumerate(shown):
        page.show(frame, splats)
        handle = page._handle

        assert page._frame.value == frame
        assert handle.scale == splats.unit
        assert np.array_equal(handle.centers, splats.centers)
        assert np.array_equal(handle.opacities, splats.opacities)


def test_colors_are_those_of_the_first_camera_until_somebody_moves(page, shown):
    page.show(0, shown[0])
    eye = page._vantages["cam00"].position.astype(np.float32)
    assert np.array_equal(page._handle.rgbs, shown[0].shade(eye))

    page._eye = eye + np.float32(3)
    page.refresh()
    assert np.array_equal(page._handle.rgbs, shown[0].shade(page._eye))


def test_controls_steer_the_playback(page):
    playback = Playback(0, 2, 30.0)
    page.steer(playback)
    page._speed.value = "2"
    page._toggle(playback)

    assert playback.is_playing
    assert page._play.label == "Pause"
    assert playback._speed == 2.0


def test_the_slider_that_the_playback_moves_does_not_move_the_playback(page, shown):
    playback = Playback(0, 2, 30.0)
    page.steer(playback)
    page.show(1, shown[1])

    assert playback.await_frame(0) == 0


def test_the_chart_marks_the_frame(page):
    page.tell(1, "| frame | 1 |")

    assert page._figures.content == "| frame | 1 |"
    assert [array.tolist() for array in page._chart.data] == [[1.0], [2.5], [2.5]]


def test_where_nobody_can_listen_there_is_no_page():
    program = Program("toy.quarc", range(2), (np.zeros(0), np.zeros(0)), {}, np.array([0, 0, 1.0]))

    with pytest.raises(OSError, match=r"^192\.0\.2\.1 cannot be listened at"):
        Page(program, ("192.0.2.1", 8080))
