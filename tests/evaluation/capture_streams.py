"""Makes streams with given cameras from random records, without training."""

import io

import numpy as np

from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format.records import Gaussians, StreamHeader
from tests.small_streams import make_births, make_symbols

_HEADER = StreamHeader(seed=5, resample_interval=2, gaussians_per_anchor=4)


def make_cloud(count=60, seed=0):
    """Return small opaque Gaussians of random colors near the plane y = 0."""
    rng = np.random.default_rng(seed)
    unit = 1 << _HEADER.lattice_exponent
    coordinates = rng.uniform([-1.2, -0.1, -0.8], [1.2, 0.1, 0.8], (count, 3)).T
    positions = (coordinates * unit / _HEADER.position_step).astype(np.int64)
    rotations = np.zeros((4, count), dtype=np.int64)
    codes = np.zeros((_HEADER.code_planes, count), dtype=np.int64)
    codes[:3] = round(np.log(0.15) / _HEADER.log_scale_step)
    codes[3] = round(2 / _HEADER.opacity_step)
    codes[4:7] = rng.integers(-40, 40, (3, count))
    return Gaussians(positions, rotations, codes)


def write_stream(cameras, frame_count, metadata=None):
    """Return the bytes of a stream with the given cameras, motion and births."""
    sink = io.BytesIO()
    loop = ClosedLoop(sink, _HEADER, tuple(cameras), metadata or {"capture": "plane"})
    if frame_count:
        loop.commit_canonical(make_cloud(), frame=0)
    for frame in range(1, frame_count):
        start = loop.start_frame(max(0, loop.state.scene.count - 60))
        moved = loop.move_frame(start, make_symbols(start.state, frame))
        loop.commit_frame(moved, make_births(moved.state, 3, frame) if frame % 2 else None)
    loop.finish()
    return sink.getvalue()
