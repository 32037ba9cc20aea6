"""A capture, its stream, and the frames of the stream in the formats of other methods."""

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
from tests.evaluation.capture_streams import write_stream
from tests.evaluation.conftest import ignore_progress

CAMERAS = ("cam01", "cam04")


@pytest.fixture(scope="session")
def method_outputs(tmp_path_factory):
    """The same four frames as a stream, as PLY files, and as renders in both layouts."""
    root = tmp_path_factory.mktemp("methods")
    capture = scenes.write_n3dv(root / "plane", scenes.make_shots(), 4, scenes.make_plane_points())
    cameras = open_capture(capture, CaptureOptions(held_out=CAMERAS)).cameras
    data = write_stream(cameras, 4)
    (root / "a.quarc").write_bytes(data)
    held_out = [camera for camera in inspect_stream(data).cameras if camera.held_out]
    for folder in ("plys", *(f"renders/{name}" for name in CAMERAS)):
        (root / folder).mkdir(parents=True)
    for scene in decode(data):
        splats = dequantize(scene)
        (root / "plys" / f"point_cloud_{scene.frame:05}.ply").write_bytes(build_ply(splats))
        (root / "by_frame" / f"{scene.frame:04}").mkdir(parents=True)
        for camera in held_out:
            levels = (render_picture(splats, camera).clip(0, 1) * 255).round().astype("uint8")
            png = build_png(levels)
            (root / "renders" / camera.name / f"{scene.frame:04}.png").write_bytes(png)
            (root / "by_frame" / f"{scene.frame:04}" / f"{camera.name}.png").write_bytes(png)
    return SimpleNamespace(folder=root, capture=capture, cameras=cameras)


@pytest.fixture(scope="session")
def compare():
    """A function that opens and measures paths; each path without a label is a method."""

    def open_and_measure(
        *paths, span=(0, None), lpips=None, on_progress=ignore_progress, **options
    ):
        sources = [
            path
            if isinstance(path, EntrySource)
            else EntrySource(Label(path.stem, path.stem), path)
            for path in paths
        ]
        options = ComparisonOptions(stop=span[1], **options)
        inputs = open_entries(sources, options, ignore_progress)
        return measure_entries(inputs, span, lpips, on_progress)

    return open_and_measure
