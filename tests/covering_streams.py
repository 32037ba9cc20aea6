"""Streams of few bytes with many Gaussians, each of which covers the whole picture."""

import io
from dataclasses import replace

import numpy as np

from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format.cameras import Camera
from quarc_ref.format.records import Gaussians, StreamHeader
from tests.small_streams import CAMERA


def make_covering_stream(count: int, width: int, height: int, frames: int = 1) -> bytes:
    """A stream of Gaussians at one position, in front of a camera of the given size."""
    header = StreamHeader(level=10 if count <= 1 << 16 else 30, log_scale_step=1.0)
    zeros = np.zeros((4 + header.code_planes, count), dtype=np.int64)
    sink = io.BytesIO()
    loop = ClosedLoop(sink, header, (make_close_camera(width, height),), {})
    loop.commit_canonical(Gaussians(zeros[:3], zeros[:4], zeros[4:]), 0)
    for _ in range(1, frames):
        start = loop.start_frame(0)
        levels = start.state.required_anchors.levels
        symbols = [
            np.zeros((6, level_anchors.owners.size), dtype=np.int64) for level_anchors in levels
        ]
        loop.commit_frame(loop.move_frame(start, symbols), None)
    loop.finish()
    return sink.getvalue()


def make_close_camera(width: int, height: int) -> Camera:
    """A camera whose whole picture a Gaussian of standard deviation 1 at the origin covers."""
    focal, center = float(max(width, height)), (width / 2, height / 2)
    return replace(
        CAMERA, width=width, height=height, fx=focal, fy=focal, cx=center[0], cy=center[1]
    )
