"""streams/ and traps/: snapshots (SPEC 7.9, 8.9)."""

from typing import Any

from making.changes import Change, Coded, Survivor
from making.payloads import pack_camera, pack_cameras
from making.scenes import between, cloud, moving, newborn, state_some
from making.snapshot_scenes import (
    FIELDS,
    NEEDS,
    differences,
    snapshot_head,
    survive,
    unchanged_survivors,
)
from making.streams import Stream
from making.trap_making import distinct_motion, distinct_symbols, make_trap_vectors
from making.update_scenes import drawn
from making.vectors import Outcome, Valid, valid

_SCENE = cloud(10, 60, 0, reach=30)


def make_snapshots() -> list[Valid]:
    """Return the streams."""
    return [snapshots_journey(), *_of_fields(), *_of_headers(), *_of_scenes(), *_of_planes()]


def snapshots_journey() -> Valid:
    """The parent of faults in snapshots: CANO 0 and 8, snapshots 3, 6 and 10, INDX."""
    stream = Stream(snapshot_head(level_count=2)).add(b"came", pack_cameras(pack_camera()))
    for frame in range(12):
        if frame in (0, 8):
            stream.canonical(frame, cloud(12, frame, reach=20))
        elif frame in (3, 6, 10):
            kept = [i for i in range(12) if i % 5 != frame % 5]
            stream.snapshot(survive(kept, frame), cloud(2, frame, reach=20))
        else:
            born = newborn([1, 4], frame) if frame % 2 else ()
            stream.frame(Change(moving(6, frame), born, deaths=frame % 2))
    stream.end(index=True)
    made = _valid("journey", "the parent of faults", "", stream)
    seek = tuple((f, Outcome(made.frames[f:])) for f in range(1, 12))
    note = "CANO 0 and 8, snapshots 3, 6 and 10, motion, births, deaths, index"
    clauses = "11.2-1 11.2-4 11.2-5 5.9-1 5.8-1 8.9"
    return _valid("journey", note, clauses, stream, seek=seek, grow=True)


def _valid(name: str, note: str, clauses: str, stream: Stream, **more: Any) -> Valid:
    named = f"1-1 1-2 {clauses}"
    return valid(f"streams/snapshots-{name}", note, named, stream, **NEEDS, **more)


def _append_frames(stream: Stream, frames: int = 3) -> Stream:
    """Append frames with motion, which shows ids and contexts."""
    channels = 3 + stream.head.rotation_components
    for frame in range(frames):
        stream.frame(Change(moving(channels, frame)))
    return stream.end()


def _of_fields() -> list[Valid]:
    made = []
    for number, (name, rows) in enumerate(FIELDS.items()):
        stream = Stream(snapshot_head()).canonical(0, cloud(10, 30 + number))
        kept = []
        for i in range(10):
            values = [between(-9, 9, i, row) if row in rows else 0 for row in range(14)]
            values[3] = 0
            kept.append(Survivor(i, tuple(values)))
        stream.snapshot(kept)
        made.append(_valid(name, f"survivors that differ in {name} alone", "7.9 8.9", stream.end()))
    turned = Stream(snapshot_head()).canonical(0, cloud(8, 36))
    turned.snapshot(Survivor(i, differences(rotation=(i % 4, 3 * i - 9, 7, i))) for i in range(8))
    note = "rotations of another index, whose components are coded without prediction"
    return [*made, _valid("turned", note, "7.9 8.9", turned.end())]


def _of_headers() -> list[Valid]:
    rows: list[tuple[str, str, dict[str, int]]] = [
        ("sh-degree-0", "Gaussians of 7 codes", {"sh_degree": 0}),
        ("updates", "with updates: recency is reset", {"incompatible_features": 6}),
        ("levels-1", "one level of anchors", {"level_count": 1}),
        ("rotation-w", "rotation residuals have w", {"rotation_components": 4}),
        ("resample-3", "sampling every 3 frames, from the snapshot on", {"resample_interval": 3}),
        ("full-crc-3", "a CRC over all fields every 3 frames", {"full_crc_interval": 3}),
        ("minor-0", "version_minor 0: only the feature bit counts", {"version_minor": 0}),
    ]
    made = []
    for number, (name, note, fields) in enumerate(rows):
        stream = Stream(snapshot_head(**fields))
        degree = stream.head.sh_degree
        stream.canonical(0, cloud(13, 70 + number, degree))
        updates = drawn(13, number) if stream.head.has_updates else ()
        stream.frame(Change(moving(3 + stream.head.rotation_components, 1), updates=updates))
        stream.snapshot(survive(range(1, 12), number), cloud(2, number, degree))
        made.append(_valid(name, note, "7.9 8.9", _append_frames(stream, 4)))
    for level in (20, 30, 31):
        stream = Stream(snapshot_head(level=level)).canonical(0, cloud(5, level))
        stream.snapshot(survive(range(5), level))
        made.append(
            _valid(f"level-{level}", f"level {level} in HEAD", "3.2-6", _append_frames(stream))
        )
    return made


def _of_scenes() -> list[Valid]:
    same = (
        Stream(snapshot_head()).canonical(0, cloud(9, 80)).snapshot(unchanged_survivors(range(9)))
    )
    born = Stream(snapshot_head()).canonical(0, cloud(9, 81)).snapshot((), cloud(7, 82))
    last = Stream(snapshot_head()).canonical(0, cloud(9, 83)).snapshot(unchanged_survivors([6]))
    rows = Stream(snapshot_head()).canonical(0, cloud(9, 84))
    rows.snapshot(survive(range(9), 1)).snapshot(survive(range(2, 9), 2), cloud(1, 85))
    far = Stream(snapshot_head(position_step=1)).canonical(0, [Coded((-9, 0, 0)), Coded((9, 1, 1))])
    far.snapshot([
        Survivor(0, differences(position=(-16383, 8000, -1))),
        Survivor(1, differences(position=(16383, -8000, 9))),
    ])  # fmt: skip
    wide = Stream(snapshot_head(position_step=1)).canonical(0, [Coded((0, 0, 0))])
    wide.snapshot(unchanged_survivors([0]), [Coded((1048575, 0, 0)), Coded((5, 1048575, 1048575))])
    codes = [Coded((i, 0, 0), codes=((-16384, 0, 16383)[i],) * 16) for i in range(3)]
    extreme = Stream(snapshot_head()).canonical(0, codes)
    extreme.snapshot([
        Survivor(0, (0,) * 7 + (32767,) * 7),
        Survivor(2, (0,) * 7 + (-32767,) * 7),
    ])  # fmt: skip
    return [
        _valid("same", "nothing has changed", "7.9 8.9", _append_frames(same)),
        _valid("newborn", "no Gaussian survives", "7.9-3", _append_frames(born)),
        _valid("last-one", "one Gaussian survives", "7.9-3", _append_frames(last)),
        _valid(
            "in-a-row",
            "a snapshot after the CANO, followed by another",
            "7.9-2",
            _append_frames(rows),
        ),
        _valid("far", "positions with large differences", "7.9-5", far.end()),
        _valid("wide", "the largest range of a snapshot", "7.9-4", wide.end()),
        _valid("extreme-codes", "codes that differ by 32767", "7.9-5", extreme.end()),
    ]


def _of_planes() -> list[Valid]:
    stated = Stream(snapshot_head()).canonical(0, cloud(9, 90))
    stated.snapshot(survive(range(8), 5), cloud(2, 91), state_some)
    named = Stream(snapshot_head()).canonical(0, cloud(9, 92))
    named.snapshot(Survivor(i, fields=31 - i) for i in range(9))
    roomy = Stream(snapshot_head()).canonical(0, cloud(4, 93))
    roomy.snapshot(unchanged_survivors([1]), cloud(3, 94), origin=(-90, -80, -70), axis_bits=19)
    return [
        _valid("stated", "every context states a probability", "8.2-1 8.9", stated.end()),
        _valid("without-changes", "fields without a difference", "8.9", named.end()),
        _valid(
            "roomy-box", "axis_bits and origin larger than needed", "8.5-1", _append_frames(roomy)
        ),
    ]


def make_snapshot_traps() -> list[Valid]:
    """Return the traps."""
    return make_trap_vectors(
        (
            (snapshots_of_the_canonical_frame, "7.9-2"),
            (snapshots_have_no_past, "7.9 8.2"),
            (snapshots_sort_anew, "7.9"),
            (equal_places_in_order, "7.9"),
            (ids_begin_anew, "7.9 7.6-5"),
            (snapshot_steps, "7.9"),
            (differences_of_neighbors, "8.9"),
            (sums_of_what_is_coded, "8.9"),
            (snapshots_sample_anew, "7.9 7.4"),
        ),
        **NEEDS,
    )


def snapshots_of_the_canonical_frame() -> Stream:
    """A snapshot is coded against the CANO, not against the frame or the snapshot before it."""
    stream = Stream(snapshot_head(sh_degree=0)).canonical(0, _SCENE).frame(distinct_motion())
    stream.snapshot(survive(range(0, 10, 2), 1)).frame(distinct_motion())
    return stream.snapshot(survive(range(10), 2)).frame(distinct_motion())


def snapshots_have_no_past() -> Stream:
    """Counts, motion and recency are reset by a snapshot."""
    stream = Stream(snapshot_head(sh_degree=0, incompatible_features=6)).canonical(0, _SCENE)
    for frame in range(1, 4):
        change = Change(moving(6, frame), newborn([2, 5], frame, 0), 2, updates=drawn(8, frame))
        stream.frame(change)
    stream.snapshot(survive(range(9), 3))
    return stream.frame(Change(moving(6, 3), updates=drawn(9, 3))).frame(distinct_motion())


def snapshots_sort_anew() -> Stream:
    """Survivors and new Gaussians are sorted together, in Morton order of their positions."""
    stream = Stream(snapshot_head(sh_degree=0)).canonical(0, _SCENE)
    moved = [Survivor(i, differences(position=(40 - 9 * i, 7 * i, -5 * i))) for i in range(10)]
    return stream.snapshot(moved, cloud(6, 61, 0, reach=50)).frame(distinct_motion())


def equal_places_in_order() -> Stream:
    """Of Gaussians at the same position survivors come first, in the order of the CANO."""
    places = [Coded((i, 0, 0), codes=(-40, -40, -40, 5 - i, i, 0, 0)) for i in range(4)]
    stream = Stream(snapshot_head(sh_degree=0, gaussians_per_anchor=1)).canonical(0, places)
    together = [Survivor(i, differences(position=(3 - i, 0, 0))) for i in range(4)]
    born = [Coded((3, 0, 0), codes=(-30, -30, -30, k, k, k, k)) for k in (9, 8)]
    return stream.snapshot(together, born).frame(distinct_motion())


def ids_begin_anew() -> Stream:
    """The next newborn after a snapshot of N Gaussians gets id N."""
    stream = Stream(snapshot_head(sh_degree=0)).canonical(0, _SCENE)
    stream.frame(Change(births=newborn([1, 2, 3], 1, 0)))
    stream.snapshot(survive(range(5), 4)).frame(Change(births=newborn([0, 4], 2, 0)))
    return stream.frame(distinct_motion())


def snapshot_steps() -> Stream:
    """Positions differ in position steps, which are not the translation steps."""
    head = snapshot_head(sh_degree=0, position_step=3, translation_step=11)
    stream = Stream(head).canonical(0, _SCENE)
    moved = [Survivor(i, differences(position=(i, -i, 1))) for i in range(10)]
    return stream.snapshot(moved).frame(distinct_motion())


def differences_of_neighbors() -> Stream:
    """Positions are coded relative to the last one whose position differs."""
    stream = Stream(snapshot_head(sh_degree=0)).canonical(0, _SCENE)
    moved = [
        Survivor(i, differences(position=(9 + i, 9 - i, 9)) if i % 3 else (0,) * 14)
        for i in range(10)
    ]
    return stream.snapshot(moved).frame(distinct_motion())


def sums_of_what_is_coded() -> Stream:
    """Contexts depend on the magnitudes of the coded numbers, field by field."""
    stream = Stream(snapshot_head(sh_degree=0)).canonical(0, _SCENE)
    changed = [
        Survivor(i, (3 * i, -2 * i, i, 0, i % 5, 1 - i % 3, 2, i, -i, i % 2, -3, i, 4 - i, 1))
        for i in range(10)
    ]
    return stream.snapshot(changed).frame(distinct_motion())


def snapshots_sample_anew() -> Stream:
    """The frame after a snapshot has phase 1, and samples."""
    head = snapshot_head(sh_degree=0, resample_interval=4, full_crc_interval=2)
    stream = Stream(head).canonical(0, _SCENE).frame(distinct_motion()).frame(distinct_motion())
    stream.snapshot(survive(range(10), 6)).frame(Change(distinct_symbols())).frame(
        distinct_motion()
    )
    return stream
