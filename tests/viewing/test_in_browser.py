"""The page in a real browser, drawn in software: slow, and skipped where there is none."""

import shutil
import threading
import time
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from quarc_ref.datasets.video import read_still
from quarc_ref.decoder import dequantize
from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import BytesSource, decode
from tests.datasets import scenes
from tests.evaluation.streams_of_captures import write_stream

pytest.importorskip("viser")
pytest.importorskip("selenium")

from selenium import webdriver

from quarc_ref.viewing.outline import outline_stream
from quarc_ref.viewing.show import Show, open_page

_BROWSER, _DRIVER = shutil.which("chromium"), shutil.which("chromedriver")
_FLAGS = (
    *("headless=new", "no-sandbox", "disable-gpu", "disable-quic", "no-first-run"),
    *("disable-background-networking", "disable-component-update", "disable-sync"),
    *("use-gl=angle", "use-angle=swiftshader", "enable-unsafe-swiftshader"),
    *("window-size=800,480", "force-device-scale-factor=1", "hide-scrollbars"),
)
_PATIENCE = 300

pytestmark = pytest.mark.skipif(
    not (_BROWSER and _DRIVER), reason="no chromium and chromedriver to show a page in"
)


def _to_camera(shot):
    rotation = shot.axes.T
    return Camera(
        shot.name, shot.width, shot.height, shot.fx, shot.fy, shot.cx, shot.cy,
        tuple(rotation.ravel()), tuple(-rotation @ shot.center), 1.0, shot.name == "cam00",
    )  # fmt: skip


@pytest.fixture(scope="module")
def data():
    return write_stream([_to_camera(shot) for shot in scenes.make_shots(2)], 4)


@pytest.fixture(scope="module")
def url(data):
    """Where the stream is shown, paused."""
    source, ended = BytesSource(data), threading.Event()
    outline, first = outline_stream(source), dequantize(next(decode(source)))
    with open_page(outline, first, "toy.quarc", ("127.0.0.1", 8760)) as page:
        show = Show(source, outline, page, playing=False)
        runner = threading.Thread(target=partial(show.run, first, 1 << 24, ended))
        runner.start()
        yield page.url
        ended.set()
        runner.join()


@pytest.fixture(scope="module")
def browser():
    options = webdriver.ChromeOptions()
    options.binary_location = _BROWSER
    for flag in _FLAGS:
        options.add_argument(f"--{flag}")
    service = webdriver.ChromeService(_DRIVER)
    browser = webdriver.Chrome(options=options, service=service)
    # A page without the focus gives up where a slow machine lets its connection wait.
    browser.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})
    yield browser
    browser.quit()


def _await_text(browser, *wanted):
    """Wait until the page says all of this; return what it says."""
    give_up, text = time.monotonic() + _PATIENCE, ""
    while time.monotonic() < give_up:
        text = browser.find_element("tag name", "body").text
        if all(part in text for part in wanted):
            return text
        time.sleep(0.2)
    pytest.fail(f"the page says {text!r} and not {wanted}")
    return text


def _photograph(browser, path):
    """The part of the page, as floats, on which neither panel nor message stands."""
    browser.save_screenshot(str(path))
    picture = read_still(path)
    return picture.shape, picture[picture.shape[0] // 2 :, : picture.shape[1] // 2] / 255


def _draw(data, camera, frame, shape):
    """What the rasterizer draws for a page of a shape, in the same part."""
    height, width = shape[:2]
    focal = camera.fy * height / camera.height
    wide = replace(
        camera, width=width, height=height, fx=focal, fy=focal, cx=width / 2, cy=height / 2
    )
    scene = next(scene for scene in decode(data) if scene.frame == frame)
    picture = np.clip(render_picture(dequantize(scene), wide), 0, 1)
    return picture[height // 2 :, : width // 2]


def _await_likeness(browser, path, expected):
    """Wait until the page, which fades in, looks as expected; return how far off it is."""
    give_up, error = time.monotonic() + _PATIENCE, 1.0
    while error > 0.03 and time.monotonic() < give_up:
        shape, picture = _photograph(browser, path)
        error = float(np.abs(picture - expected(shape)).mean())
    return error


def test_the_page_shows_what_the_first_camera_sees_and_plays(browser, url, data, tmp_path):
    browser.get(url)
    _await_text(browser, "toy.quarc", "frame 0, canonical", "Gaussians 60", "paused")
    camera = outline_stream(BytesSource(data)).cameras[0]
    expected = partial(_draw, data, camera, 0)

    assert expected((480, 800)).std() > 0.1
    assert _await_likeness(browser, tmp_path / "first.png", expected) <= 0.03

    play = next(b for b in browser.find_elements("tag name", "button") if b.text == "Play")
    play.click()
    _await_text(browser, "moved", "motion", "per second, of 30", "Pause")


def test_the_chart_has_all_frames(browser, url, tmp_path):
    browser.get(url)
    _await_text(browser, "toy.quarc", "KB per frame")
    path, give_up, share = tmp_path / "chart.png", time.monotonic() + _PATIENCE, 0.0
    while share < 0.5 and time.monotonic() < give_up:
        browser.find_element("css selector", ".uplot canvas").screenshot(str(path))
        picture = read_still(path).astype(int)
        is_blue = picture[..., 2] > picture[..., 0] + 30
        share = is_blue.any(axis=0).mean()
    assert share >= 0.5
