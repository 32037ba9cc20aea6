"""Decoded frames, the input of exporters, and their activated values."""

import numpy as np
import pytest

from quarc_ref.decoder import Scene, Splats, dequantize
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.table import EXPORT_FORMATS
from quarc_ref.format.records import StreamHeader
from tests.small_streams import CAMERA, make_stream


def make_frame(degree: int) -> tuple[Scene, Splats]:
    """Return the last frame of a small stream, which includes births."""
    _, states = make_stream(StreamHeader(seed=7, gaussians_per_anchor=4, sh_degree=degree))
    return states[-1].scene, dequantize(states[-1].scene)


def make_clip(**header):
    """Return the properties and the frames of a small stream with births."""
    stream_header = StreamHeader(seed=7, gaussians_per_anchor=4, sh_rest_step=1 / 128, **header)
    _, states = make_stream(stream_header)
    return Clip(stream_header, (CAMERA,), {}), [Frame.from_scene(state.scene) for state in states]


def export(name, clip, frames):
    """Export the last frame, or all frames if the format is a sequence; return the bytes."""
    entry = EXPORT_FORMATS[name]
    if entry.package:
        pytest.importorskip(entry.package, reason=f"install it with pip install '.[{entry.extra}]'")
    if not entry.is_sequence:
        return entry.load_builder()(frames[-1], clip)
    sequence = entry.begin(clip)
    for frame in frames:
        sequence.add(frame)
    return sequence.finish()


def compute_opacities(splats):
    return 1 / (1 + np.exp(-splats.opacities.astype(float)))


def compute_colors(splats):
    return np.clip(0.5 + 0.28209479177387814 * splats.sh[:, 0], 0, 1)


def compare_rotations(first, second):
    """Return the minimum cosine of half the angle between pairs of rotations."""
    products = np.abs((first * second).sum(axis=1))
    return products.min()
