"""Makes streams in streams/; each tests one feature of updates (SPEC 7.8, 8.8)."""

from typing import Any

from making.changes import Change, CodedGaussian, Update
from making.payloads import pack_camera, pack_cameras, pack_metadata
from making.scenes import (
    choose_varied_codes,
    make_births,
    make_cloud,
    make_moving_symbols,
    pick_between,
)
from making.streams import Stream
from making.update_scenes import (
    FIELD_RANGES,
    REQUIRED_CAPABILITY,
    make_deleting_updates,
    make_equal_updates,
    make_random_updates,
    make_residuals,
    make_update_head,
)
from making.vectors import Outcome, ValidStream, make_valid_stream


def make_update_streams() -> list[ValidStream]:
    """Return all streams."""
    return [
        make_updates_journey(),
        *_make_field_streams(),
        *_make_extreme_streams(),
        *_make_header_streams(),
        *_make_deletion_streams(),
        *_make_plane_streams(),
    ]


def make_updates_journey() -> ValidStream:
    """Return the parent of update faults; frames 0, 3 and 6 of its 9 frames are canonical."""
    head = make_update_head(rotation_components=4, sh_degree=1, level_count=2)
    stream = Stream(head).add_chunk(b"came", pack_cameras(pack_camera()))
    for frame in (0, 3, 6):
        stream.add_canonical(frame, make_cloud(12, frame, limit=20))
        if frame == 3:
            stream.add_chunk(b"meta", pack_metadata(("title", "before frame 4")))
        stream.add_frame(
            Change(make_moving_symbols(7, frame + 1), updates=make_random_updates(12, frame))
        )
        gaussian_count = _count_gaussians(stream) - 1
        deleted_count = sum(
            update.residuals is None for update in make_random_updates(gaussian_count, frame + 1)
        )
        births = make_births([2, gaussian_count - deleted_count - 1], frame)
        change = Change(
            make_moving_symbols(7, frame + 2),
            births,
            death_count=1,
            updates=make_random_updates(gaussian_count, frame + 1),
        )
        stream.add_frame(change)
    stream.finish(index=True)
    without_seek = _make_update_stream("journey", "", "", stream)
    seek = tuple((f, Outcome(without_seek.frames[f:])) for f in range(1, 9))
    note = "canonical frames 0, 3 and 6, motion, updates, births, deaths, INDX"
    return _make_update_stream("journey", note, "11.2-1 8.8", stream, seek=seek, grow=True)


def _make_update_stream(
    name: str, note: str, clauses: str, stream: Stream, **options: Any
) -> ValidStream:
    all_clauses = f"1-1 1-2 {clauses}"
    return make_valid_stream(
        f"streams/updates-{name}", note, all_clauses, stream, **REQUIRED_CAPABILITY, **options
    )


def _count_gaussians(stream: Stream) -> int:
    state = stream.states[-1]
    assert state is not None
    return len(state.gaussians)


def _append_frames(stream: Stream, frame_count: int, seed: int) -> Stream:
    """Append `frame_count` frames with motion and updates, and finish the stream."""
    channels = 3 + stream.head.rotation_components
    for frame in range(1, frame_count + 1):
        updates = make_random_updates(_count_gaussians(stream), seed + frame)
        stream.add_frame(Change(make_moving_symbols(channels, seed + frame), updates=updates))
    return stream.finish()


def _make_field_streams() -> list[ValidStream]:
    streams = []
    for number, (name, rows) in enumerate(FIELD_RANGES.items()):
        stream = Stream(make_update_head()).add_canonical(0, make_cloud(10, 30 + number))
        for frame in range(1, 4):
            random_rows = [
                [pick_between(-9, 9, frame, i, row) if row in rows else 0 for row in range(13)]
                for i in range(0, 10, 1 + frame % 2)
            ]
            indices = range(0, 10, 1 + frame % 2)
            updates = tuple(Update(i, tuple(r)) for i, r in zip(indices, random_rows, strict=True))
            stream.add_frame(Change(make_moving_symbols(6, frame), updates=updates))
        streams.append(
            _make_update_stream(
                name, f"updates that change only {name}", "7.8 8.8", stream.finish()
            )
        )
    equal_updates_stream = Stream(make_update_head()).add_canonical(0, make_cloud(10, 36))
    residuals = tuple(range(-6, 7))
    equal_updates_stream.add_frame(
        Change(make_moving_symbols(6, 1), updates=make_equal_updates(10, residuals))
    ).finish()
    streams.append(
        _make_update_stream(
            "of-all", "the same update for every Gaussian", "7.8 8.8", equal_updates_stream
        )
    )
    return streams


def _make_extreme_streams() -> list[ValidStream]:
    position_limit = 8388607
    far_stream = Stream(make_update_head(position_step=1, translation_step=65535)).add_canonical(
        0, [CodedGaussian((0, 0, 0)), CodedGaussian((524287, 1, 2))]
    )
    far_stream.add_frame(Change(updates=(Update(0, make_residuals(translation=(100, -128, 0))),)))
    far_stream.add_frame(
        Change(updates=(Update(0, make_residuals(translation=(-200, 256, 1))),))
    ).finish()
    edge_stream = Stream(make_update_head(position_step=1, translation_step=1)).add_canonical(
        0,
        [
            CodedGaussian((position_limit - 2, 1 - position_limit, 0)),
            CodedGaussian((position_limit - 1, 2 - position_limit, 1)),
        ],
    )
    edge_stream.add_frame(Change(updates=(Update(0, make_residuals(translation=(1, -1, 0))),)))
    gaussians = [
        CodedGaussian((i, 0, 0), codes=((-32767, 0, 32767)[i % 3],) * 16) for i in range(4)
    ]
    extreme_stream = Stream(make_update_head()).add_canonical(0, gaussians)
    max_residuals, min_residuals = (32767,) * 7, (-32767,) * 7
    extreme_stream.add_frame(
        Change(updates=(Update(0, (0,) * 6 + max_residuals), Update(2, (0,) * 6 + min_residuals)))
    )
    extreme_stream.add_frame(
        Change(updates=(Update(0, (0,) * 6 + max_residuals), Update(2, (0,) * 6 + min_residuals)))
    ).finish()
    streams = [
        _make_update_stream(
            "far", "updates that move a Gaussian across the whole lattice", "7.8-2", far_stream
        ),
        _make_update_stream(
            "edge",
            "updates that move a Gaussian to the edge of the lattice",
            "7.8-2",
            append_frame_at_edge(edge_stream),
        ),
        _make_update_stream(
            "extreme-codes",
            "updates that move codes from one end of their range to the other",
            "7.8-3",
            extreme_stream,
        ),
    ]
    for unity in (1, 256):
        stream = Stream(make_update_head(rotation_unity=unity, rotation_components=4))
        stream.add_canonical(0, make_cloud(6, 40 + unity))
        rotations = ((256, 0, 0), (-256, 256, -256), (0, 0, 1), (0, -1, 0), (255, 1, 7), (0, 0, 0))
        updates = tuple(Update(i, make_residuals(rotation=t), 2) for i, t in enumerate(rotations))
        stream.add_frame(Change(updates=updates)).add_frame(
            Change(make_moving_symbols(7, 3), updates=updates)
        ).finish()
        note = f"rotation residuals up to 256, with rotation_unity {unity}"
        streams.append(_make_update_stream(f"turns-{unity}", note, "7.8-4 7.3", stream))
    return streams


def append_frame_at_edge(stream: Stream) -> Stream:
    """Append a frame that moves a Gaussian away from the lattice edge, and finish the stream."""
    return stream.add_frame(
        Change(updates=(Update(0, make_residuals(translation=(-3, 3, 0))),))
    ).finish()


def _make_header_streams() -> list[ValidStream]:
    rows: list[tuple[str, str, dict[str, int]]] = [
        *((f"levels-{n}", f"level_count is {n}", {"level_count": n}) for n in (1, 2, 3)),
        *((f"resample-{n}", f"resample_interval is {n}", {"resample_interval": n}) for n in (1, 3)),
        *((f"full-crc-{n}", f"full_crc_interval is {n}", {"full_crc_interval": n}) for n in (1, 3)),
        (
            "rotation-w",
            "rotation residuals of anchors with a w component",
            {"rotation_components": 4},
        ),
        ("all-anchors", "every Gaussian is an anchor", {"gaussians_per_anchor": 1}),
        ("sh-degree-0", "Gaussians without SH rest (7 codes)", {"sh_degree": 0}),
        (
            "minor-0",
            "version_minor is 0; the feature bit alone enables updates",
            {"version_minor": 0},
        ),
        ("minor-9", "a later minor version", {"version_minor": 9}),
    ]
    streams = []
    for number, (name, note, fields) in enumerate(rows):
        head = make_update_head(**fields)
        stream = Stream(head).add_canonical(0, make_cloud(14, 50 + number, head.sh_degree))
        streams.append(
            _make_update_stream(name, note, "7.8 8.8 12-2", _append_frames(stream, 5, 10 * number))
        )
    for level in (20, 30, 31):
        stream = Stream(make_update_head(level=level)).add_canonical(0, make_cloud(5, level))
        streams.append(
            _make_update_stream(
                f"level-{level}",
                f"level {level} in HEAD",
                "3.2-2",
                _append_frames(stream, 2, level),
            )
        )
    return streams


def _make_deletion_streams() -> list[ValidStream]:
    deletion_stream = Stream(make_update_head()).add_canonical(0, make_cloud(14, 70))
    for frame, deleted_indices in enumerate(((0, 5, 13), (2,), (), (0, 1, 2, 3))):
        deletion_stream.add_frame(
            Change(make_moving_symbols(6, frame), updates=make_deleting_updates(deleted_indices))
        )
    last_gaussian_stream = Stream(make_update_head(level_count=2)).add_canonical(
        0, make_cloud(6, 71)
    )
    last_gaussian_stream.add_frame(
        Change(updates=make_deleting_updates((0, 1, 3, 4, 5)))
    ).add_frame(Change(make_moving_symbols(6, 1))).finish()
    mixed_stream = Stream(make_update_head(resample_interval=3)).add_canonical(
        0, make_cloud(12, 72)
    )
    for frame in range(1, 8):
        count = _count_gaussians(mixed_stream) - frame % 2
        updates = make_random_updates(count, 72 + frame, updates_per_deletion=3)
        deleted_count = sum(update.residuals is None for update in updates)
        parents = [pick_between(0, count - deleted_count - 1, frame, k) for k in range(frame % 4)]
        change = Change(
            make_moving_symbols(6, frame), make_births(parents, frame), frame % 2, updates=updates
        )
        mixed_stream.add_frame(change)
    segment_stream = Stream(make_update_head())
    for frame in (0, 4):
        segment_stream.add_canonical(frame, make_cloud(9, 73 + frame))
        for offset in range(1, 4):
            change = Change(
                make_moving_symbols(6, frame + offset),
                updates=make_random_updates(_count_gaussians(segment_stream), offset),
            )
            segment_stream.add_frame(change)
    return [
        _make_update_stream(
            "leaving", "updates delete Gaussians", "7.8-1", deletion_stream.finish()
        ),
        _make_update_stream(
            "last-one", "updates delete all Gaussians but one", "7.8-1", last_gaussian_stream
        ),
        _make_update_stream(
            "births-and-deaths",
            "updates, births, deaths",
            "7.8-1 7.6-1 7.4-3",
            mixed_stream.finish(),
        ),
        _make_update_stream(
            "segments",
            "a canonical frame resets counts and recency",
            "7.8 8.2",
            segment_stream.finish(index=True),
        ),
    ]


def _make_plane_streams() -> list[ValidStream]:
    empty_stream = Stream(make_update_head()).add_canonical(0, make_cloud(7, 80))
    empty_stream.add_frame(Change(make_moving_symbols(6, 1))).add_frame().add_frame(
        Change(make_moving_symbols(6, 2))
    ).finish()
    unchanged_stream = Stream(make_update_head()).add_canonical(0, make_cloud(7, 81))
    updates_without_field = tuple(Update(i) for i in (0, 3, 6))
    updates_without_change = tuple(Update(i, field_mask=31 - i) for i in range(5))
    unchanged_stream.add_frame(Change(updates=updates_without_field)).add_frame(
        Change(updates=updates_without_change)
    )
    unchanged_stream.add_frame(
        Change(make_moving_symbols(6, 2), updates=make_random_updates(7, 81))
    ).finish()
    stated_stream = Stream(make_update_head()).add_canonical(0, make_cloud(9, 82))
    stated_stream.add_frame(
        Change(
            make_moving_symbols(6, 1),
            updates=make_random_updates(9, 82),
            choose_code=choose_varied_codes,
        )
    )
    stated_stream.add_frame(
        Change(
            make_moving_symbols(6, 2),
            updates=make_random_updates(_count_gaussians(stated_stream), 3),
            choose_code=choose_varied_codes,
        )
    )
    wide_stream = Stream(make_update_head(translation_step=1)).add_canonical(0, make_cloud(24, 83))
    for frame in range(1, 4):
        rows = [[pick_between(-(1 << (i % 9)), 1 << (i % 9), frame, i, r) for r in range(13)]
                for i in range(24)]  # fmt: skip
        rows = [[max(-256, min(256, v)) if 3 <= r < 6 else v for r, v in enumerate(row)]
                for row in rows]  # fmt: skip
        updates = tuple(Update(i, tuple(row)) for i, row in enumerate(rows))
        wide_stream.add_frame(Change(make_moving_symbols(6, frame), updates=updates))
    recency_stream = Stream(make_update_head()).add_canonical(0, make_cloud(12, 84))
    for frame in range(1, 9):
        indices = [i for i in range(12) if i % 4 >= frame % 4]
        updates = tuple(Update(i, make_residuals(opacity=frame - 4)) for i in indices)
        recency_stream.add_frame(Change(make_moving_symbols(6, frame // 2), updates=updates))
    return [
        _make_update_stream(
            "none", "FEATURE_UPDATES is set, but no frame has updates", "8.8", empty_stream
        ),
        _make_update_stream(
            "without-fields",
            "updates without changed fields, and changed fields whose residuals are all 0",
            "8.8",
            unchanged_stream,
        ),
        _make_update_stream(
            "stated", "every context states a probability code", "8.2-1 8.8", stated_stream.finish()
        ),
        _make_update_stream(
            "wide", "residuals of many magnitudes", "8.8 8.4", wide_stream.finish()
        ),
        _make_update_stream(
            "recent", "Gaussians with every value of recency", "7.8 8.8", recency_stream.finish()
        ),
    ]
