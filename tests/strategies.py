"""Strategies of hypothesis: headers, Gaussians, births, symbols."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from quarc_ref.format.coding.motion_planes import LevelContext
from quarc_ref.format.constants import RESIDUAL_ROWS
from quarc_ref.format.records import Births, Gaussians, StreamHeader
from quarc_ref.format.updates import Updates

_STEPS = st.sampled_from([1 / 64, 1 / 16, 1 / 8, 0.5, 3.0])


@st.composite
def headers(draw) -> StreamHeader:
    return StreamHeader(
        timescale=draw(st.integers(1, 100_000)),
        lattice_exponent=draw(st.integers(0, 24)),
        position_step=draw(st.integers(1, 16)),
        translation_step=draw(st.integers(1, 16)),
        rotation_unity=draw(st.integers(10, 256)),
        rotation_components=draw(st.sampled_from([3, 4])),
        rotation_bits=draw(st.integers(1, 14)),
        log_scale_step=draw(_STEPS),
        opacity_step=draw(_STEPS),
        sh_dc_step=draw(_STEPS),
        sh_rest_step=draw(_STEPS),
        sh_degree=draw(st.integers(0, 1)),
        level_count=draw(st.integers(1, 3)),
        gaussians_per_anchor=draw(st.integers(1, 8)),
        anchor_ratio=draw(st.integers(2, 4)),
        resample_interval=draw(st.integers(1, 3)),
        full_crc_interval=draw(st.integers(1, 4)),
        seed=draw(st.integers(0, (1 << 64) - 1)),
        updates=draw(st.booleans()),
    )


def integers(rows: int, count: int, minimum: int, maximum: int) -> st.SearchStrategy:
    """Arrays `[rows, count]` with many equal values."""
    values = st.one_of(st.integers(minimum, maximum), st.sampled_from(sorted({minimum, maximum})))
    return arrays(np.int64, (rows, count), elements=values)


@st.composite
def rotations(draw, count: int, bits: int) -> np.ndarray:
    """Rotation codes `[4, count]`: components up to half a unit quaternion."""
    limit = (1 << bits) // 2
    largest = draw(integers(1, count, 0, 3))
    return np.concatenate([largest, draw(integers(3, count, -limit, limit))])


@st.composite
def gaussians(draw, header: StreamHeader, count: int, limit: int = 1000) -> Gaussians:
    return Gaussians(
        draw(integers(3, count, -limit, limit)),
        draw(rotations(count, header.rotation_bits)),
        draw(integers(header.code_planes, count, -300, 300)),
    )


@st.composite
def births(draw, header: StreamHeader, count: int, scene_count: int) -> Births:
    parents = draw(st.lists(st.integers(0, scene_count - 1), min_size=count, max_size=count))
    return Births(np.array(sorted(parents), dtype=np.int64), draw(gaussians(header, count, 50)))


@st.composite
def updates(draw, scene_count: int) -> Updates:
    """Updates of some Gaussians of a scene; at least one Gaussian remains."""
    indices = st.integers(0, scene_count - 1)
    chosen_indices = np.array(sorted(draw(st.sets(indices))), dtype=np.int64)
    is_deleted = draw(arrays(np.bool_, chosen_indices.size))
    is_deleted[chosen_indices == draw(indices)] = False
    if is_deleted.sum() == scene_count:
        is_deleted[0] = False
    fields = np.repeat(draw(arrays(np.bool_, (5, chosen_indices.size))), (3, 3, 3, 1, 3), axis=0)
    residuals = draw(integers(RESIDUAL_ROWS, chosen_indices.size, -256, 256))
    return Updates(chosen_indices, is_deleted, residuals * (fields & ~is_deleted))


@st.composite
def motions(draw):
    """Contexts and symbols of each level, beginning with level 1."""
    channels = draw(st.sampled_from([6, 7]))
    sizes = draw(st.lists(st.integers(1, 12), min_size=1, max_size=3))
    contexts, symbols = [], []
    for index, size in enumerate(sizes):
        coarser = sizes[index + 1] if index + 1 < len(sizes) else 1
        parents = draw(st.lists(st.integers(0, coarser - 1), min_size=size, max_size=size))
        previous = draw(integers(channels, size, -20, 20))
        contexts.append(LevelContext(np.array(parents), previous))
        symbols.append(draw(integers(channels, size, -4, 4)))
    return contexts, symbols
