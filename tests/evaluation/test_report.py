import base64
import io
from dataclasses import replace
from html.parser import HTMLParser

import matplotlib.image
import numpy as np
import pytest

from quarc_ref.evaluation.report import DIFFERENCE_GAIN, write_report
from quarc_ref.files import MARKER_NAME, written_folder
from quarc_ref.inspection.inspect_stream import inspect_stream
from tests.small_streams import make_stream

_PNG = "data:image/png;base64,"


class _Page(HTMLParser):
    """Collects the references, the text and the unclosed tags of a page."""

    def __init__(self, text):
        super().__init__()
        self.sources, self.references, self.words, self.tags, self.open = [], [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        if tag not in {"meta", "img", "br", "link"}:
            self.open.append(tag)
        for name, value in attributes:
            if name == "src":
                self.sources.append(value)
            elif name in {"href", "action", "data", "srcset", "poster"}:
                self.references.append(value)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, text):
        self.words.append(text)

    def text(self):
        return " ".join(" ".join(self.words).split())


def _write_page(evaluation, folder):
    with written_folder(folder) as output:
        assert write_report(evaluation, output) == output.path / "index.html"
    return folder / "index.html"


@pytest.fixture(scope="module")
def report(evaluation, tmp_path_factory):
    """The folder of a report."""
    folder = tmp_path_factory.mktemp("reports") / "report"
    _write_page(evaluation, folder)
    return folder


@pytest.fixture(scope="module")
def page(report):
    return _Page((report / "index.html").read_text("utf-8"))


def _read_png(png):
    return np.round(matplotlib.image.imread(io.BytesIO(png))[..., :3] * 255)


def test_the_page_is_self_contained(report, page):
    text = (report / "index.html").read_text("utf-8")

    assert page.references == []
    assert all(source.startswith(_PNG) for source in page.sources)
    assert "script" not in page.tags
    assert "link" not in page.tags
    assert "http" not in text
    assert "url(" not in text
    assert "@import" not in text
    assert "$" not in text
    assert page.open == []


def test_the_pictures_in_the_page_equal_the_files_next_to_it(report, page):
    embedded = {base64.b64decode(source.removeprefix(_PNG)) for source in page.sources}
    files = {path.name: path.read_bytes() for path in report.glob("*.png")}

    assert embedded == set(files.values())
    assert len(files) == 3 * 3 + 2
    assert sorted(path.name for path in report.iterdir()) == sorted(
        [MARKER_NAME, *files, "index.html"]
    )
    assert all(_read_png(png).size > 0 for png in files.values())


def test_truth_decoded_and_difference_of_three_frames_are_shown(report, evaluation):
    for view in evaluation.shown_views:
        stem = f"{view.camera}_{view.frame:04}"
        pictures = {
            "truth": view.truth,
            "decoded": view.decoded,
            "difference": np.clip(DIFFERENCE_GAIN * np.abs(view.decoded - view.truth), 0, 1),
        }
        for name, picture in pictures.items():
            written = _read_png((report / f"{stem}_{name}.png").read_bytes())
            assert np.abs(written - 255 * picture).max() <= 0.5 + 1e-3


def test_the_page_names_all_held_out_cameras(page):
    assert "measured on cam01, cam04, held out from training" in page.text()


def test_the_figures_are_those_of_the_evaluation(page, evaluation):
    summary, quality = evaluation.summary, evaluation.quality
    text = page.text()

    assert f"{np.mean(quality.psnr):.2f} dB" in text
    assert f"{min(quality.psnr):.2f} dB" in text
    assert f"{np.mean(quality.ssim):.4f}" in text
    assert f"{summary.kilobytes_per_frame()['without_canonical']:.2f}" in text
    assert f"{summary.total_bytes:,} bytes" in text
    for kind, size in summary.coded_bytes().items():
        assert f"{kind} {size:,}" in text
    for kind, estimate in summary.estimate_bytes().items():
        assert f"{kind} {summary.coded_bytes()[kind]:,} {estimate:,}" in text
    assert "ssim_inria" in text
    assert "motion.lr=0.1" in text


def test_a_stream_of_keyframes_has_no_mean_of_other_frames(evaluation, tmp_path):
    stream, _ = make_stream(canonical_every=1)
    of_keyframes = replace(evaluation, summary=inspect_stream(stream))

    page = _Page(_write_page(of_keyframes, tmp_path / "report").read_text("utf-8"))

    assert "KB per frame, without keyframes no such frame" in page.text()


def test_text_from_a_stream_is_escaped(page):
    assert "b" not in page.tags
    assert "<b>plane</b>: 4 frames" in page.text()


@pytest.mark.parametrize("camera", ["../../up\\<i>", "/cam<i>" * 100])
def test_a_camera_name_cannot_lead_to_another_folder(camera, evaluation, tmp_path):
    shown_views = tuple(replace(view, camera=camera) for view in evaluation.shown_views)
    evaluation_with_path = replace(evaluation, shown_views=shown_views)
    (tmp_path / "a").mkdir()
    page = _write_page(evaluation_with_path, tmp_path / "a" / "b")

    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert {path.parent for path in files} == {page.parent}
    assert len(files) == 3 * 3 + 4
    assert "i" not in _Page(page.read_text("utf-8")).tags


def test_a_report_replaces_an_older_one(report, evaluation, tmp_path):
    folder = tmp_path / "report"
    _write_page(evaluation, folder)
    (folder / "index.html").write_text("old")
    with written_folder(folder, replace=True) as output:
        write_report(evaluation, output)

    assert (folder / "index.html").read_bytes() == (report / "index.html").read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["report"]


def test_the_page_has_a_line_for_each_held_out_camera_and_for_their_mean(page, evaluation):
    text = page.text()

    for cells in evaluation.quality.as_rows():
        assert " ".join(cells) in text
