"""streams/: updates of single Gaussians, one feature for each stream (SPEC 7.8, 8.8)."""

from typing import Any

from making.changes import Change, Coded, Update
from making.payloads import pack_camera, pack_cameras, pack_metadata
from making.scenes import between, cloud, moving, newborn, state_some
from making.streams import Stream
from making.update_scenes import FIELDS, NEEDS, drawn, leaving, of_all, residuals, update_head
from making.vectors import Outcome, Valid, valid


def make_updates() -> list[Valid]:
    """Return all streams."""
    return [
        updates_journey(),
        *_of_fields(),
        *_of_extremes(),
        *_of_headers(),
        *_of_lives(),
        *_of_planes(),
    ]


def updates_journey() -> Valid:
    """The parent of faults in updates: frames 0 to 8, canonical 0, 3 and 6, INDX."""
    head = update_head(rotation_components=4, sh_degree=1, level_count=2)
    stream = Stream(head).add(b"came", pack_cameras(pack_camera()))
    for frame in (0, 3, 6):
        stream.canonical(frame, cloud(12, frame, reach=20))
        if frame == 3:
            stream.add(b"meta", pack_metadata(("title", "before frame 4")))
        stream.frame(Change(moving(7, frame + 1), updates=drawn(12, frame)))
        last = _count(stream) - 1
        gone = sum(update.residuals is None for update in drawn(last, frame + 1))
        born = newborn([2, last - gone - 1], frame)
        change = Change(moving(7, frame + 2), born, deaths=1, updates=drawn(last, frame + 1))
        stream.frame(change)
    stream.end(index=True)
    made = _valid("journey", "the parent of faults", "", stream)
    seek = tuple((f, Outcome(made.frames[f:])) for f in range(1, 9))
    note = "canonical frames 0, 3 and 6, motion, updates, births, deaths, index"
    return _valid("journey", note, "11.2-1 8.8", stream, seek=seek, grow=True)


def _valid(name: str, note: str, clauses: str, stream: Stream, **more: Any) -> Valid:
    named = f"1-1 1-2 {clauses}"
    return valid(f"streams/updates-{name}", note, named, stream, **NEEDS, **more)


def _count(stream: Stream) -> int:
    state = stream.states[-1]
    assert state is not None
    return len(state.gaussians)


def _filled(stream: Stream, frames: int, seed: int) -> Stream:
    """Append frames with motion and updates."""
    channels = 3 + stream.head.rotation_components
    for frame in range(1, frames + 1):
        updates = drawn(_count(stream), seed + frame)
        stream.frame(Change(moving(channels, seed + frame), updates=updates))
    return stream.end()


def _of_fields() -> list[Valid]:
    made = []
    for number, (name, rows) in enumerate(FIELDS.items()):
        stream = Stream(update_head()).canonical(0, cloud(10, 30 + number))
        for frame in range(1, 4):
            random_rows = [
                [between(-9, 9, frame, i, row) if row in rows else 0 for row in range(13)]
                for i in range(0, 10, 1 + frame % 2)
            ]
            chosen = range(0, 10, 1 + frame % 2)
            updates = tuple(Update(i, tuple(r)) for i, r in zip(chosen, random_rows, strict=True))
            stream.frame(Change(moving(6, frame), updates=updates))
        made.append(_valid(name, f"updates of {name} alone", "7.8 8.8", stream.end()))
    every = Stream(update_head()).canonical(0, cloud(10, 36))
    rows = tuple(range(-6, 7))
    every.frame(Change(moving(6, 1), updates=of_all(10, rows))).end()
    made.append(_valid("of-all", "the same update of every Gaussian", "7.8 8.8", every))
    return made


def _of_extremes() -> list[Valid]:
    far = 8388607
    one = Stream(update_head(position_step=1, translation_step=65535)).canonical(
        0, [Coded((0, 0, 0)), Coded((524287, 1, 2))]
    )
    one.frame(Change(updates=(Update(0, residuals(translation=(100, -128, 0))),)))
    one.frame(Change(updates=(Update(0, residuals(translation=(-200, 256, 1))),))).end()
    edge = Stream(update_head(position_step=1, translation_step=1)).canonical(
        0, [Coded((far - 2, 1 - far, 0)), Coded((far - 1, 2 - far, 1))]
    )
    edge.frame(Change(updates=(Update(0, residuals(translation=(1, -1, 0))),)))
    codes = [Coded((i, 0, 0), codes=((-32767, 0, 32767)[i % 3],) * 16) for i in range(4)]
    extreme = Stream(update_head()).canonical(0, codes)
    up, down = (32767,) * 7, (-32767,) * 7
    extreme.frame(Change(updates=(Update(0, (0,) * 6 + up), Update(2, (0,) * 6 + down))))
    extreme.frame(Change(updates=(Update(0, (0,) * 6 + up), Update(2, (0,) * 6 + down)))).end()
    made = [
        _valid("far", "translations across the lattice", "7.8-2", one),
        _valid("edge", "updates up to the edge of the lattice", "7.8-2", edge_of(edge)),
        _valid("extreme-codes", "codes from one end of their range to the other", "7.8-3", extreme),
    ]
    for unity in (1, 256):
        stream = Stream(update_head(rotation_unity=unity, rotation_components=4))
        stream.canonical(0, cloud(6, 40 + unity))
        turns = ((256, 0, 0), (-256, 256, -256), (0, 0, 1), (0, -1, 0), (255, 1, 7), (0, 0, 0))
        updates = tuple(Update(i, residuals(rotation=t), 2) for i, t in enumerate(turns))
        stream.frame(Change(updates=updates)).frame(Change(moving(7, 3), updates=updates)).end()
        note = f"rotation residuals up to 256, with rotation_unity {unity}"
        made.append(_valid(f"turns-{unity}", note, "7.8-4 7.3", stream))
    return made


def edge_of(stream: Stream) -> Stream:
    """Return a stream after a frame that moves a Gaussian back from the edge."""
    return stream.frame(Change(updates=(Update(0, residuals(translation=(-3, 3, 0))),))).end()


def _of_headers() -> list[Valid]:
    rows: list[tuple[str, str, dict[str, int]]] = [
        *((f"levels-{n}", f"{n} levels of anchors", {"level_count": n}) for n in (1, 2, 3)),
        *((f"resample-{n}", f"sampling every {n}", {"resample_interval": n}) for n in (1, 3)),
        *((f"full-crc-{n}", f"a CRC of all every {n}", {"full_crc_interval": n}) for n in (1, 3)),
        ("rotation-w", "rotation residuals of anchors have w", {"rotation_components": 4}),
        ("all-anchors", "every Gaussian is an anchor", {"gaussians_per_anchor": 1}),
        ("sh-degree-0", "Gaussians of 7 codes", {"sh_degree": 0}),
        ("minor-0", "version_minor 0: only the feature bit counts", {"version_minor": 0}),
        ("minor-9", "a later minor version", {"version_minor": 9}),
    ]
    made = []
    for number, (name, note, fields) in enumerate(rows):
        head = update_head(**fields)
        stream = Stream(head).canonical(0, cloud(14, 50 + number, head.sh_degree))
        made.append(_valid(name, note, "7.8 8.8 12-2", _filled(stream, 5, 10 * number)))
    for level in (20, 30, 31):
        stream = Stream(update_head(level=level)).canonical(0, cloud(5, level))
        made.append(
            _valid(f"level-{level}", f"level {level} in HEAD", "3.2-2", _filled(stream, 2, level))
        )
    return made


def _of_lives() -> list[Valid]:
    leavers = Stream(update_head()).canonical(0, cloud(14, 70))
    for frame, gone in enumerate(((0, 5, 13), (2,), (), (0, 1, 2, 3))):
        leavers.frame(Change(moving(6, frame), updates=leaving(gone)))
    down = Stream(update_head(level_count=2)).canonical(0, cloud(6, 71))
    down.frame(Change(updates=leaving((0, 1, 3, 4, 5)))).frame(Change(moving(6, 1))).end()
    both = Stream(update_head(resample_interval=3)).canonical(0, cloud(12, 72))
    for frame in range(1, 8):
        count = _count(both) - frame % 2
        updates = drawn(count, 72 + frame, leaving=3)
        gone = sum(update.residuals is None for update in updates)
        parents = [between(0, count - gone - 1, frame, k) for k in range(frame % 4)]
        change = Change(moving(6, frame), newborn(parents, frame), frame % 2, updates=updates)
        both.frame(change)
    segments = Stream(update_head())
    for frame in (0, 4):
        segments.canonical(frame, cloud(9, 73 + frame))
        for more in range(1, 4):
            change = Change(moving(6, frame + more), updates=drawn(_count(segments), more))
            segments.frame(change)
    return [
        _valid("leaving", "Gaussians leave by updates", "7.8-1", leavers.end()),
        _valid("last-one", "all Gaussians but one leave", "7.8-1", down),
        _valid("births-and-deaths", "updates, births, deaths", "7.8-1 7.6-1 7.4-3", both.end()),
        _valid("segments", "counts and recency are reset", "7.8 8.2", segments.end(index=True)),
    ]


def _of_planes() -> list[Valid]:
    still = Stream(update_head()).canonical(0, cloud(7, 80))
    still.frame(Change(moving(6, 1))).frame().frame(Change(moving(6, 2))).end()
    named = Stream(update_head()).canonical(0, cloud(7, 81))
    empty = tuple(Update(i) for i in (0, 3, 6))
    zeros = tuple(Update(i, fields=31 - i) for i in range(5))
    named.frame(Change(updates=empty)).frame(Change(updates=zeros))
    named.frame(Change(moving(6, 2), updates=drawn(7, 81))).end()
    stated = Stream(update_head()).canonical(0, cloud(9, 82))
    stated.frame(Change(moving(6, 1), updates=drawn(9, 82), stating=state_some))
    stated.frame(Change(moving(6, 2), updates=drawn(_count(stated), 3), stating=state_some))
    wide = Stream(update_head(translation_step=1)).canonical(0, cloud(24, 83))
    for frame in range(1, 4):
        rows = [[between(-(1 << (i % 9)), 1 << (i % 9), frame, i, r) for r in range(13)]
                for i in range(24)]  # fmt: skip
        rows = [[max(-256, min(256, v)) if 3 <= r < 6 else v for r, v in enumerate(row)]
                for row in rows]  # fmt: skip
        updates = tuple(Update(i, tuple(row)) for i, row in enumerate(rows))
        wide.frame(Change(moving(6, frame), updates=updates))
    recent = Stream(update_head()).canonical(0, cloud(12, 84))
    for frame in range(1, 9):
        chosen = [i for i in range(12) if i % 4 >= frame % 4]
        updates = tuple(Update(i, residuals(opacity=frame - 4)) for i in chosen)
        recent.frame(Change(moving(6, frame // 2), updates=updates))
    return [
        _valid("none", "a stream with updates whose frames have none", "8.8", still),
        _valid("without-fields", "changes without a field, fields without a change", "8.8", named),
        _valid("stated", "every context states a probability", "8.2-1 8.8", stated.end()),
        _valid("wide", "residuals of all sizes", "8.8 8.4", wide.end()),
        _valid("recent", "recency of every value", "7.8 8.8", recent.end()),
    ]
