"""Frames that `quarc-capture.json` ignores are neither read nor trained on."""

import io
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.ignored_frames import IgnoredFrames
from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.frames.change_gate import compute_gate_weights
from quarc_ref.encoder.resume.partial_stream import read_partial_stream
from quarc_ref.encoder.training import measurements
from quarc_ref.encoder.training.context import TrainingContext, make_context
from quarc_ref.encoder.training.losses import photometric_loss
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.format.errors import UnusableCaptureError
from quarc_ref.streams.source import BytesSource
from tests.encoder import toys
from tests.encoder.toys import SMALL, make_capture

_CONFIG = replace(
    SMALL,
    stream=replace(SMALL.stream, updates=True),
    canonical=replace(SMALL.canonical, exposure_lr=0.1, prune_rd_lambda=1e-4),
    updates=replace(SMALL.updates, lr=0.1, quantize_rd_lambda=1e-6),
    motion=replace(SMALL.motion, follow_exposures=True),
    births=replace(SMALL.births, placement="errors", error_threshold=0.03, rd_lambda=1e-6),
)
_GATED = replace(_CONFIG, births=replace(SMALL.births, gate_views=3))


class _FailingSource:
    """A picture source that cannot read some pictures of camera 2."""

    def __init__(self, capture, frames):
        self._capture, self._frames = capture, frames

    def read(self, camera, frame):
        if camera == 2 and frame in self._frames:
            raise CaptureError
        return self._capture.image(camera, frame).copy()


def _make_failing_capture(frames, spans=None):
    """Return a capture whose camera 2 fails in some frames; `spans` are ignored."""
    capture = make_capture(5)
    ignored_frames = IgnoredFrames({"cam02": tuple(spans)} if spans else {})
    return Capture(
        capture.name, capture.cameras, 5, 30.0, capture.points, _FailingSource(capture, frames),
        capture.fingerprint, notes=CaptureNotes(ignored_frames=ignored_frames),
    )  # fmt: skip


def _encode(capture, config=_CONFIG, sink=None, partial_stream=None):
    sink = sink or io.BytesIO()
    encode(capture, sink, EncodeOptions(config, device="cpu"), partial_stream)
    return sink.getvalue()


@pytest.mark.parametrize("config", [_CONFIG, _GATED], ids=["births at errors", "change gate"])
def test_ignored_pictures_are_never_read_or_trained_on(config, monkeypatch):
    trained = set()
    loss = TrainingContext.photometric_loss
    monkeypatch.setattr(
        TrainingContext,
        "photometric_loss",
        lambda self, image, view, frame, weight: (
            trained.add((view, frame)) or loss(self, image, view, frame, weight)
        ),
    )

    _encode(_make_failing_capture({0, 2, 3}, [(0, 0), (2, 3)]), config)

    every_view = {(view, frame) for view in range(3) for frame in range(5)}
    assert trained == every_view - {(1, 0), (1, 2), (1, 3)}


def test_an_encode_can_be_resumed_without_the_frames_that_failed():
    failing = _make_failing_capture({3, 4})
    sink = io.BytesIO()
    with pytest.raises(CaptureError):
        _encode(failing, sink=sink)
    partial_stream = read_partial_stream(BytesSource(sink.getvalue()))
    assert len(partial_stream.frames) == 3

    repaired = _make_failing_capture({3, 4}, [(3, None)])
    resumed = _encode(repaired, sink=sink, partial_stream=partial_stream)

    assert resumed == _encode(repaired)


def test_the_reference_loss_is_the_mean_of_the_used_views(monkeypatch):
    context = make_context(_make_failing_capture({1}, [(1, 1)]), "cpu", 0)
    pictures = [context.views.picture(view, 1) for view in range(3)]
    images = [torch.full_like(picture, 0.5) for picture in pictures]
    pairs = list(zip(images, pictures, strict=True))
    monkeypatch.setattr(measurements, "render_views", lambda *_: pairs)
    state = SimpleNamespace(scene=SimpleNamespace(frame=1))

    loss = measurements.measure_loss(context, state, 0.2)

    losses = [float(photometric_loss(*pairs[view], 0.2)) for view in (0, 2)]
    assert loss == pytest.approx(np.mean(losses))


@pytest.mark.parametrize("frame", [1, 2])
def test_the_change_gate_leaves_out_a_view_without_one_of_the_two_pictures(frame):
    context = make_context(_make_failing_capture({1}, [(1, 1)]), "cpu", 0)
    rendered = []
    render = context.rasterizer.render

    class Rasterizer:
        def render(self, gaussians, camera, background):
            rendered.append(camera.name)
            return render(gaussians, camera, background)

    context = replace(context, rasterizer=Rasterizer())
    attributes = from_splats(toys.make_splats(0), torch.device("cpu"))

    compute_gate_weights(context, attributes, frame, 3)

    assert rendered == ["cam01", "cam03"]


def test_two_cameras_must_be_left_in_the_first_frame():
    capture = _make_failing_capture({0}, [(0, 0)])
    capture.notes.ignored_frames.spans["cam03"] = ((0, 0),)

    with pytest.raises(UnusableCaptureError, match="has 1 training camera"):
        _encode(capture)
