"""Makes streams in streams/; each tests one feature of snapshots (SPEC 7.9, 8.9)."""

from typing import Any

from making.changes import Change, CodedGaussian, Survivor
from making.payloads import pack_camera, pack_cameras
from making.scenes import (
    choose_varied_codes,
    make_births,
    make_cloud,
    make_moving_symbols,
    pick_between,
)
from making.snapshot_scenes import (
    FIELD_RANGES,
    REQUIRED_CAPABILITY,
    make_differences,
    make_random_survivors,
    make_snapshot_head,
    make_unchanged_survivors,
)
from making.streams import Stream
from making.update_scenes import make_random_updates
from making.vectors import Outcome, ValidStream, make_valid_stream


def make_snapshot_streams() -> list[ValidStream]:
    """Return the valid streams with snapshots."""
    return [
        make_snapshots_journey(),
        *_make_field_streams(),
        *_make_header_streams(),
        *_make_scene_streams(),
        *_make_plane_streams(),
    ]


def make_snapshots_journey() -> ValidStream:
    """Return the parent of snapshot faults; frames 3, 6 and 10 are snapshots, 0 and 8 canonical."""
    stream = Stream(make_snapshot_head(level_count=2)).add_chunk(
        b"came", pack_cameras(pack_camera())
    )
    for frame in range(12):
        if frame in (0, 8):
            stream.add_canonical(frame, make_cloud(12, frame, limit=20))
        elif frame in (3, 6, 10):
            survivors = [i for i in range(12) if i % 5 != frame % 5]
            stream.add_snapshot(
                make_random_survivors(survivors, frame), make_cloud(2, frame, limit=20)
            )
        else:
            births = make_births([1, 4], frame) if frame % 2 else ()
            stream.add_frame(Change(make_moving_symbols(6, frame), births, death_count=frame % 2))
    stream.finish(index=True)
    without_seek = _make_snapshot_stream("journey", "", "", stream)
    seek = tuple((f, Outcome(without_seek.frames[f:])) for f in range(1, 12))
    note = "canonical frames 0 and 8, snapshots 3, 6 and 10, motion, births, deaths, INDX"
    clauses = "11.2-1 11.2-4 11.2-5 5.9-1 5.8-1 8.9"
    return _make_snapshot_stream("journey", note, clauses, stream, seek=seek, grow=True)


def _make_snapshot_stream(
    name: str, note: str, clauses: str, stream: Stream, **options: Any
) -> ValidStream:
    all_clauses = f"1-1 1-2 {clauses}"
    return make_valid_stream(
        f"streams/snapshots-{name}", note, all_clauses, stream, **REQUIRED_CAPABILITY, **options
    )


def _append_frames(stream: Stream, frame_count: int = 3) -> Stream:
    """Append frames whose motion reveals wrong ids and contexts, and finish the stream."""
    channels = 3 + stream.head.rotation_components
    for frame in range(frame_count):
        stream.add_frame(Change(make_moving_symbols(channels, frame)))
    return stream.finish()


def _make_field_streams() -> list[ValidStream]:
    streams = []
    for number, (name, rows) in enumerate(FIELD_RANGES.items()):
        stream = Stream(make_snapshot_head()).add_canonical(0, make_cloud(10, 30 + number))
        survivors = []
        for i in range(10):
            values = [pick_between(-9, 9, i, row) if row in rows else 0 for row in range(14)]
            values[3] = 0
            survivors.append(Survivor(i, tuple(values)))
        stream.add_snapshot(survivors)
        streams.append(
            _make_snapshot_stream(
                name, f"survivors whose differences are all in {name}", "7.9 8.9", stream.finish()
            )
        )
    rotation_stream = Stream(make_snapshot_head()).add_canonical(0, make_cloud(8, 36))
    rotation_stream.add_snapshot(
        Survivor(i, make_differences(rotation=(i % 4, 3 * i - 9, 7, i))) for i in range(8)
    )
    note = "rotations whose index j changes, so that their components are coded without prediction"
    return [*streams, _make_snapshot_stream("turned", note, "7.9 8.9", rotation_stream.finish())]


def _make_header_streams() -> list[ValidStream]:
    rows: list[tuple[str, str, dict[str, int]]] = [
        ("sh-degree-0", "Gaussians without SH rest (7 codes)", {"sh_degree": 0}),
        (
            "updates",
            "a stream with updates, in which the snapshot resets recency",
            {"incompatible_features": 6},
        ),
        ("levels-1", "one anchor level", {"level_count": 1}),
        ("rotation-w", "rotation residuals with a w component", {"rotation_components": 4}),
        (
            "resample-3",
            "anchors are sampled every 3 frames, counted from the snapshot",
            {"resample_interval": 3},
        ),
        ("full-crc-3", "the state CRC covers all fields every 3 frames", {"full_crc_interval": 3}),
        (
            "minor-0",
            "version_minor is 0; the feature bit alone enables snapshots",
            {"version_minor": 0},
        ),
    ]
    streams = []
    for number, (name, note, fields) in enumerate(rows):
        stream = Stream(make_snapshot_head(**fields))
        sh_degree = stream.head.sh_degree
        stream.add_canonical(0, make_cloud(13, 70 + number, sh_degree))
        updates = make_random_updates(13, number) if stream.head.has_updates else ()
        stream.add_frame(
            Change(make_moving_symbols(3 + stream.head.rotation_components, 1), updates=updates)
        )
        stream.add_snapshot(
            make_random_survivors(range(1, 12), number), make_cloud(2, number, sh_degree)
        )
        streams.append(_make_snapshot_stream(name, note, "7.9 8.9", _append_frames(stream, 4)))
    for level in (20, 30, 31):
        stream = Stream(make_snapshot_head(level=level)).add_canonical(0, make_cloud(5, level))
        stream.add_snapshot(make_random_survivors(range(5), level))
        streams.append(
            _make_snapshot_stream(
                f"level-{level}", f"level {level} in HEAD", "3.2-6", _append_frames(stream)
            )
        )
    return streams


def _make_scene_streams() -> list[ValidStream]:
    unchanged_stream = (
        Stream(make_snapshot_head())
        .add_canonical(0, make_cloud(9, 80))
        .add_snapshot(make_unchanged_survivors(range(9)))
    )
    newborn_stream = (
        Stream(make_snapshot_head())
        .add_canonical(0, make_cloud(9, 81))
        .add_snapshot((), make_cloud(7, 82))
    )
    last_survivor_stream = (
        Stream(make_snapshot_head())
        .add_canonical(0, make_cloud(9, 83))
        .add_snapshot(make_unchanged_survivors([6]))
    )
    consecutive_stream = Stream(make_snapshot_head()).add_canonical(0, make_cloud(9, 84))
    consecutive_stream.add_snapshot(make_random_survivors(range(9), 1)).add_snapshot(
        make_random_survivors(range(2, 9), 2), make_cloud(1, 85)
    )
    far_stream = Stream(make_snapshot_head(position_step=1)).add_canonical(
        0, [CodedGaussian((-9, 0, 0)), CodedGaussian((9, 1, 1))]
    )
    far_stream.add_snapshot([
        Survivor(0, make_differences(position=(-16383, 8000, -1))),
        Survivor(1, make_differences(position=(16383, -8000, 9))),
    ])  # fmt: skip
    wide_stream = Stream(make_snapshot_head(position_step=1)).add_canonical(
        0, [CodedGaussian((0, 0, 0))]
    )
    wide_stream.add_snapshot(
        make_unchanged_survivors([0]),
        [CodedGaussian((1048575, 0, 0)), CodedGaussian((5, 1048575, 1048575))],
    )
    gaussians = [CodedGaussian((i, 0, 0), codes=((-16384, 0, 16383)[i],) * 16) for i in range(3)]
    extreme_stream = Stream(make_snapshot_head()).add_canonical(0, gaussians)
    extreme_stream.add_snapshot([
        Survivor(0, (0,) * 7 + (32767,) * 7),
        Survivor(2, (0,) * 7 + (-32767,) * 7),
    ])  # fmt: skip
    return [
        _make_snapshot_stream(
            "same", "a snapshot without changes", "7.9 8.9", _append_frames(unchanged_stream)
        ),
        _make_snapshot_stream(
            "newborn",
            "a snapshot in which no Gaussian survives",
            "7.9-3",
            _append_frames(newborn_stream),
        ),
        _make_snapshot_stream(
            "last-one",
            "a snapshot in which one Gaussian survives",
            "7.9-3",
            _append_frames(last_survivor_stream),
        ),
        _make_snapshot_stream(
            "in-a-row",
            "two consecutive snapshots directly after the CANO",
            "7.9-2",
            _append_frames(consecutive_stream),
        ),
        _make_snapshot_stream(
            "far", "positions with large differences", "7.9-5", far_stream.finish()
        ),
        _make_snapshot_stream(
            "wide",
            "the widest range of positions that a snapshot allows",
            "7.9-4",
            wide_stream.finish(),
        ),
        _make_snapshot_stream(
            "extreme-codes", "codes that change by 32767", "7.9-5", extreme_stream.finish()
        ),
    ]


def _make_plane_streams() -> list[ValidStream]:
    stated_stream = Stream(make_snapshot_head()).add_canonical(0, make_cloud(9, 90))
    stated_stream.add_snapshot(
        make_random_survivors(range(8), 5), make_cloud(2, 91), choose_varied_codes
    )
    masked_stream = Stream(make_snapshot_head()).add_canonical(0, make_cloud(9, 92))
    masked_stream.add_snapshot(Survivor(i, field_mask=31 - i) for i in range(9))
    large_box_stream = Stream(make_snapshot_head()).add_canonical(0, make_cloud(4, 93))
    large_box_stream.add_snapshot(
        make_unchanged_survivors([1]), make_cloud(3, 94), origin=(-90, -80, -70), axis_bits=19
    )
    return [
        _make_snapshot_stream(
            "stated", "every context states a probability code", "8.2-1 8.9", stated_stream.finish()
        ),
        _make_snapshot_stream(
            "without-changes",
            "fields that are coded as changed but have no difference",
            "8.9",
            masked_stream.finish(),
        ),
        _make_snapshot_stream(
            "roomy-box",
            "axis_bits and the distance to the origin are larger than needed",
            "8.5-1",
            _append_frames(large_box_stream),
        ),
    ]
