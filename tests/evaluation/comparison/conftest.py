"""A capture, a stream of it, and the same frames in the formats of other methods."""

from types import SimpleNamespace

import pytest

from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.datasets.video_writer import build_png
from quarc_ref.decoder import dequantize
from quarc_ref.evaluation.comparison.entries import Label
from quarc_ref.evaluation.comparison.measure import measure_entries
from quarc_ref.evaluation.comparison.open_entries import (
    ComparisonOptions,
    EntrySource,
    open_entries,
)
from quarc_ref.export.gaussian_ply import build_ply
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.rendering.pictures import render_picture
from quarc_ref.streams import decode
from tests.datasets import scenes
from tests.evaluation.conftest import ignore
from tests.evaluation.streams_of_captures import write_stream

CAMERAS = ("cam01", "cam04")


@pytest.fixture(scope="session")
def rivals(tmp_path_factory):
    """One stream of four frames as a file, as PLY files, and as renders in both layouts."""
    place = tmp_path_factory.mktemp("rivals")
    capture = scenes.write_n3dv(place / "plane", scenes.make_shots(), 4, scenes.plane_points())
    cameras = open_capture(capture, CaptureOptions(held_out=CAMERAS)).cameras
    data = write_stream(cameras, 4)
    (place / "a.quarc").write_bytes(data)
    held_out = [camera for camera in inspect_stream(data).cameras if camera.held_out]
    for folder in ("plys", *(f"renders/{name}" for name in CAMERAS)):
        (place / folder).mkdir(parents=True)
    for scene in decode(data):
        splats = dequantize(scene)
        (place / "plys" / f"point_cloud_{scene.frame:05}.ply").write_bytes(build_ply(splats))
        (place / "by_frame" / f"{scene.frame:04}").mkdir(parents=True)
        for camera in held_out:
            levels = (render_picture(splats, camera).clip(0, 1) * 255).round().astype("uint8")
            png = build_png(levels)
            (place / "renders" / camera.name / f"{scene.frame:04}.png").write_bytes(png)
            (place / "by_frame" / f"{scene.frame:04}" / f"{camera.name}.png").write_bytes(png)
    return SimpleNamespace(place=place, capture=capture, cameras=cameras)


@pytest.fixture(scope="session")
def compare():
    """Open and measure paths, each as its own method or with a label."""

    def run(*paths, span=(0, None), lpips=None, **wanted):
        named = [
            each
            if isinstance(each, EntrySource)
            else EntrySource(Label(each.stem, each.stem), each)
            for each in paths
        ]
        opened = open_entries(named, ComparisonOptions(**wanted), ignore)
        return measure_entries(opened, span, lpips, ignore)

    return run
