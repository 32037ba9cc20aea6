"""Encodes Gaussians as a stream, and compares its frames with them."""

import io

import numpy as np

from quarc_ref.decoder import dequantize
from quarc_ref.encoder import SceneOptions, encode_scenes
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.streams import decode
from tests.encoder.scenes.given import select_rows

OPTIONS = SceneOptions(bounds=Bounds(position=0.002))


def encode(scenes, options=OPTIONS):
    sink = io.BytesIO()
    report = encode_scenes(scenes, sink, options)
    return sink.getvalue(), report


def find_nearest(decoded, expected):
    distances = np.linalg.norm(decoded.positions[:, None] - expected.positions[None], axis=2)
    return distances.argmin(axis=1), distances.min(axis=1)


def assert_close(data, scenes, position=0.002):
    """Check that decoded and input Gaussians match one to one within the default bounds."""
    frames = [dequantize(scene) for scene in decode(data)]
    assert len(frames) == len(scenes)
    for decoded, expected in zip(frames, scenes, strict=True):
        rows, _ = find_nearest(decoded, expected)
        assert sorted(rows) == list(range(len(expected.positions)))
        matched = select_rows(expected, rows)
        tolerance = 1e-5
        assert np.abs(decoded.positions - matched.positions).max() <= position + tolerance
        cosines = np.abs((decoded.rotations * matched.rotations).sum(axis=1))
        assert 2 * np.arccos(np.minimum(cosines, 1)).max() <= 0.02 + 1e-3
        assert np.abs(decoded.log_scales - matched.log_scales).max() <= 1 / 32 + tolerance
        assert np.abs(decoded.opacities - matched.opacities).max() <= 1 / 16 + tolerance
        degree_one = matched.sh[:, : decoded.sh.shape[1]]
        assert np.abs(decoded.sh - degree_one).max() <= 1 / 64 + tolerance
