"""Stream C of Annex G: features that streams A and B lack, from hand-made records."""

import numpy as np

from quarc_ref.format import wire
from quarc_ref.format.records import Births, Gaussians, StreamHeader
from tests.spec.annex_streams import StreamWriter, build_symbols, columns


def make_deep() -> StreamWriter:
    """Stream C: level 31, three levels, resampling, births with SH rest, a second CANO."""
    header = StreamHeader(
        level=31,
        rotation_components=3,
        level_count=3,
        gaussians_per_anchor=1,
        anchor_ratio=2,
        resample_interval=2,
        full_crc_interval=2,
        seed=0xFEDCBA9876543210,
    )
    writer = StreamWriter(header)
    writer.chunk(b"HEAD", wire.build_stream_header(header))
    writer.canonical(_make_canonical(), frame=1000)
    _move_and_add_births(writer)

    begun_state = writer.begin(0)
    writer.frame(begun_state, build_symbols(begun_state), None, use_previous=True)

    begun_state = writer.begin(0)
    symbols = build_symbols(begun_state, (1, 0, [0, 2, 0, 0, 0, -1]), (2, 1, [1, 0, 0, 0, 0, 0]))
    writer.frame(begun_state, symbols, None, use_previous=False)

    begun_state = writer.begin(1)
    symbols = build_symbols(begun_state, (1, 0, [0, 1, 0, 0, 0, -1]), (3, 0, [0, 0, -9, 0, 7, 0]))
    writer.frame(begun_state, symbols, None, use_previous=True)

    canonical = _make_canonical()
    last_two = Gaussians(
        canonical.positions[:, 3:], canonical.rotations[:, 3:], canonical.codes[:, 3:]
    )
    writer.canonical(last_two, frame=1005)
    begun_state = writer.begin(0)
    writer.frame(
        begun_state, build_symbols(begun_state, (1, 1, [2, 0, 0, 0, 0, 0])), None, use_previous=True
    )
    writer.tail(index=False)
    return writer


def _move_and_add_births(writer: StreamWriter) -> None:
    """Write a frame with motion on all levels, and two births of one parent with SH rest."""
    begun_state = writer.begin(0)
    symbols = build_symbols(
        begun_state,
        (1, 2, [1, 0, -1, 0, 0, 2]),
        (2, 0, [0, -2, 0, 3, 0, 0]),
        (3, 0, [2, 0, 0, -1, 0, 0]),
    )
    rotations = columns([1, 40, 0, -3], [0, 0, 0, 0])
    first = [-37, -40, -40, 14, 3, 5, 5, 2, 0, 0, 5, 0, 0, 0, 0, -7]
    second = [-38, -40, -40, 9, 5, 6, 5, *[0] * 8, 33]
    newborn = Gaussians(columns([2, 0, -1], [-2, 0, 1]), rotations, columns(first, second))
    births = Births(np.array([2, 2], dtype=np.int64), newborn)
    writer.frame(begun_state, symbols, births, use_previous=False)


def _make_canonical() -> Gaussians:
    sh_rest = [[0] * 9 for _ in range(5)]
    sh_rest[0][:3], sh_rest[3][8], sh_rest[4][4] = [2, 2, 1], -4, 1
    codes_without_sh_rest = (
        [-40, -40, -41, 10, 5, 5, 5],
        [-40, -40, -40, 12, 5, 5, 4],
        [-38, -40, -40, -6, 5, 6, 5],
        [-40, -40, -40, 10, 0, 0, 0],
        [-40, -44, -40, 11, -9, 5, 5],
    )
    return Gaussians(
        columns([0, 0, 0], [9, 1, 0], [9, 1, 0], [0, 40, 7], [33, 40, 7]),
        columns([0, 0, 0, 0], [0, 5, 0, 0], [2, 0, 90, 0], [0, 0, 0, 0], [3, 1, 1, 1]),
        columns(
            *(codes + rest for codes, rest in zip(codes_without_sh_rest, sh_rest, strict=True))
        ),
    )
