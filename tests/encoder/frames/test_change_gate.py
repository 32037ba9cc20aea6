import numpy as np
import torch

from quarc_ref.encoder.frames.change_gate import compute_gate_weights
from quarc_ref.encoder.training.trainable import from_splats
from tests.encoder.toys import make_context, make_splats


def test_the_gate_opens_only_where_the_picture_changes():
    context = make_context()
    splats = make_splats(1)
    attributes = from_splats(splats, torch.device("cpu"))

    weights = compute_gate_weights(context, attributes, frame=1, view_count=3).numpy()

    wall, blobs = weights[:63], weights[63:]
    assert weights.min() >= 0
    assert weights.max() < 1
    assert np.median(blobs) > 0.5
    assert np.median(blobs) > 2 * np.median(wall)


def test_between_equal_pictures_the_gate_stays_closed(monkeypatch):
    context = make_context()
    picture = context.truth(0, 0)
    for name in ("truth", "previous_truth"):
        monkeypatch.setattr(type(context), name, lambda *_: picture)
    attributes = from_splats(make_splats(0), torch.device("cpu"))

    assert not compute_gate_weights(context, attributes, frame=1, view_count=3).any()


def test_a_change_of_exposure_alone_does_not_open_the_gate():
    context = make_context()
    pictures = [context.views.picture(view, 0) for view in range(3)]
    gains = torch.tensor([1.0, 1.0, 0.5])  # dividing by these is exact
    for view, picture in enumerate(pictures):
        context.views._pictures[view, 1] = picture * gains[view]
    context.exposures.follow(zip(pictures, pictures, strict=True))  # as in frame 1
    context.exposures.gains = gains[:, None].repeat(1, 3)
    attributes = from_splats(make_splats(0), torch.device("cpu"))

    assert not compute_gate_weights(context, attributes, frame=1, view_count=3).any()


def test_without_views_the_gate_is_open_everywhere():
    attributes = from_splats(make_splats(0), torch.device("cpu"))

    assert compute_gate_weights(
        make_context(), attributes, frame=1, view_count=0
    ).unique().tolist() == [1]
