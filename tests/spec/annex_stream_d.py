"""Stream D of Annex G, with the features of version 1.1, from hand-made records."""

import numpy as np

from quarc_ref.format import wire
from quarc_ref.format.constants import RESIDUAL_ROWS
from quarc_ref.format.records import Births, Gaussians, StreamHeader
from quarc_ref.format.updates import UPDATE_FIELDS, Updates
from tests.spec.annex_streams import StreamWriter, build_symbols, columns


def make_changing() -> StreamWriter:
    """Stream D: updates, a death by update, a birth, a snapshot, and a frame after it."""
    header = StreamHeader(
        rotation_components=3,
        sh_degree=0,
        level_count=1,
        gaussians_per_anchor=3,
        resample_interval=2,
        rotation_unity=32,
        rotation_bits=6,
        full_crc_interval=1,
        seed=0x1111222233334444,
        updates=True,
        snapshots=True,
    )
    writer = StreamWriter(header)
    writer.chunk(b"HEAD", wire.build_stream_header(header))
    writer.canonical(_make_six_gaussians(), frame=10)
    _update_and_add_births(writer)
    _update_again(writer)
    _write_snapshot(writer)

    begun_state = writer.begin(0)
    updates = _updates((5, {"opacity": [3]}))
    writer.frame(begun_state, build_symbols(begun_state), None, use_previous=False, updates=updates)
    writer.tail(index=True)
    return writer


def _update_and_add_births(writer: StreamWriter) -> None:
    """Frame 11: one anchor moves, two Gaussians change, one leaves, one is born."""
    begun_state = writer.begin(0)
    updates = _updates(
        (0, {"translation": [2, 0, -1], "rotation": [0, 3, 0]}),
        (2, None),
        (4, {"log-scales": [1, 1, 0], "opacity": [-2], "SH DC": [0, 4, -4]}),
    )
    newborn = Gaussians(
        columns([1, 0, -2]), columns([0, 0, 0, 0]), columns([-20, -20, -20, 4, 9, 8, 7])
    )
    # The parent is the Gaussian with id 3, because the Gaussian with id 2 has left.
    births = Births(np.array([2], dtype=np.int64), newborn)
    symbols = build_symbols(begun_state, (1, 0, [1, 0, 0, 0, 0, -2]))
    writer.frame(begun_state, symbols, births, use_previous=False, updates=updates)


def _update_again(writer: StreamWriter) -> None:
    """Frame 12: contexts of recency; one Gaussian is coded as changing without any field."""
    begun_state = writer.begin(0)
    updates = _updates(
        (0, {"translation": [-1, 1, 1]}),
        (1, {}),
        (5, {"opacity": [5]}),
    )
    writer.frame(begun_state, build_symbols(begun_state), None, use_previous=True, updates=updates)


def _write_snapshot(writer: StreamWriter) -> None:
    """Frame 13: five survivors and two others."""
    positions = columns(
        *([2, 0, -1], [1, 2, 0], [9, 1, 0], [60, 40, 7], [64, 38, 7]), *([61, 40, 7], [0, 0, 90])
    )
    rotations = columns(
        *([0, 0, 4, 0], [1, 2, 0, 0], [2, 0, 30, 0], [0, 0, 0, 0], [3, 1, 1, 1]),
        *([0, 0, 0, 0], [0, 9, 0, 0]),
    )
    codes = columns(
        [-20, -20, -21, 10, 5, 5, 5],
        [-20, -20, -20, 12, 5, 5, 4],
        [-18, -20, -20, 4, 5, 6, 5],
        [-20, -20, -20, 10, 0, 0, 0],
        [-19, -23, -20, 8, -9, 9, 1],
        [-20, -20, -20, 9, 9, 8, 7],
        [-12, -12, -16, 20, 3, 3, 3],
    )
    writer.snapshot(Gaussians(positions, rotations, codes), [0, 1, 3, 4, 5, -1, -1])


def _updates(*changes: tuple[int, dict[str, list[int]] | None]) -> Updates:
    """Return updates from pairs (index, residuals by field); None for a Gaussian that leaves."""
    residuals = np.zeros((RESIDUAL_ROWS, len(changes)), dtype=np.int64)
    for column, (_, fields) in enumerate(changes):
        for name, values in (fields or {}).items():
            residuals[UPDATE_FIELDS[name], column] = values
    indices = np.array([index for index, _ in changes], dtype=np.int64)
    dies = np.array([fields is None for _, fields in changes], dtype=np.bool_)
    return Updates(indices, dies, residuals)


def _make_six_gaussians() -> Gaussians:
    return Gaussians(
        columns([0, 0, 0], [1, 0, 0], [9, 1, 0], [9, 1, 0], [60, 40, 7], [63, 40, 7]),
        columns(
            *([0, 0, 0, 0], [0, 5, 0, 0], [1, 0, 0, 0], [2, 0, 30, 0], [0, 0, 0, 0], [3, 1, 1, 1])
        ),
        columns(
            [-20, -20, -21, 10, 5, 5, 5],
            [-20, -20, -20, 12, 5, 5, 4],
            [-16, -16, -16, -8, 20, 20, 20],
            [-18, -20, -20, 4, 5, 6, 5],
            [-20, -20, -20, 10, 0, 0, 0],
            [-20, -24, -20, 11, -9, 5, 5],
        ),
    )
