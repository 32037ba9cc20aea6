"""levels/: streams at the limits of their levels (SPEC 3.2), and one beyond."""

import zlib
from dataclasses import replace

from making.changes import Change, Coded, Update
from making.payloads import Frame, Head
from making.planes import update_planes
from making.scenes import cloud, moving
from making.streams import Piece, Stream
from making.update_scenes import NEEDS, update_head
from making.vectors import Outcome, Splice, Valid, Vector, broken, valid
from making.writing import Planes, WritingSection
from plain.updates import read_updates

LEVELS = {10: (65536, 4096, 1 << 22), 20: (262144, 16384, 1 << 24)}
_POINT = Coded((0, 0, 0), codes=(0,) * 7)
_FEW = {"level": 10, "sh_degree": 0, "level_count": 1, "gaussians_per_anchor": 65535}


def make_levels() -> list[Valid]:
    """Return the streams within the limits of their level."""
    most, births, _ = LEVELS[10]
    full = _replace_one(Stream(Head(**_FEW)).canonical(0, [_POINT] * most))
    grown = Stream(Head(level=10, sh_degree=0)).canonical(0, [_POINT] * 5)
    grown.frame(Change(births=(_POINT,) * births))
    wider = Stream(Head(level=20, sh_degree=0)).canonical(0, [_POINT] * 5)
    wider.frame(Change(births=(_POINT,) * (births + 1)))
    full_updated = _replace_by_update(Stream(update_head(**_FEW)).canonical(0, [_POINT] * most))
    made = [
        valid(
            "levels/10-updates",
            "the maximum number of Gaussians of level 1.0; one leaves by an update, one is born",
            "3.2-1 3.2-2 7.8",
            full_updated.end(),
            **NEEDS,
        ),
        valid(
            "levels/10-gaussians",
            "the maximum number of Gaussians of level 1.0 in a few bytes; one dies, one is born",
            "3.2-1 3.2-2",
            full.end(),
        ),
        valid(
            "levels/10-births", "the maximum number of births of level 1.0", "3.2-3", grown.end()
        ),
        valid(
            "levels/20-births",
            "more births than level 1.0 allows, at level 2.0",
            "3.2-3",
            wider.end(),
        ),
    ]
    for level in (10, 20, 30, 31):
        stream = Stream(Head(level=level)).canonical(0, cloud(4)).frame(Change(moving(6, level)))
        made.append(
            valid(f"levels/{level}", f"level {level} in HEAD", "1-1", stream.end(index=True))
        )
    return made


def _replace_one(stream: Stream) -> Stream:
    """Append a frame in which the first of equal Gaussians dies, and an equal one is born.

    Written without decoding 65536 Gaussians: nothing moves, and no bit is 1.
    """
    before = stream.states[0]
    assert before is not None
    last = replace(before.gaussians[0], id=len(before.gaussians))
    left = [*before.gaussians[1:], last]
    state = replace(before, frame=1, phase=1, gaussians=left, next_id=last.id + 1)
    crc = zlib.crc32(state.serialize(codes=False))
    stream.places.append(len(stream.pieces))
    stream.pieces.append(Piece(b"FRAM", Frame(1, 0, 1, 1, (), (), crc).pack()))
    stream.states.append(state)
    return stream


def _replace_by_update(stream: Stream) -> Stream:
    """Append a frame in which the first of equal Gaussians leaves by an update, as above.

    The words are those of the planes of 65536 Gaussians, written without their state.
    """
    before = stream.states[0]
    assert before is not None
    count = len(before.gaussians)
    section = WritingSection("updates", Planes(update_planes(count, (Update(0, None),))), {})
    read_updates(section, before.gaussians)
    section.close()
    last = replace(before.gaussians[0], id=count, recency=0)
    left = [*before.gaussians[1:], last]
    state = replace(before, frame=1, phase=1, gaussians=left, next_id=count + 1)
    crc = zlib.crc32(state.serialize(codes=False))
    stream.places.append(len(stream.pieces))
    frame = Frame(1, 0, 0, 1, (), (), crc, tuple(section.written))
    stream.pieces.append(Piece(b"FRAM", frame.pack()))
    stream.states.append(state)
    return stream


def make_larger(levels: list[Valid]) -> list[Vector]:
    """Return streams that are generated on demand, with payloads at the limit of their level."""
    made = []
    for level, (_, _, size) in LEVELS.items():
        parent = next(each for each in levels if each.vector.name == f"levels/{level}")
        for more, refused in ((0, ()), (1, ("chunk-exceeds-level",))):
            pieces = parent.stream.before(Piece(b"note", bytes(size + more)), place=1)
            frames = [] if refused else parent.frames
            name = f"levels/{level}-payload" + ("-beyond" if more else "")
            allowed = "one more than" if more else "what"
            note = f"an ancillary payload of {size + more} bytes, {allowed} the level allows"
            clauses = "3.2-4 5.2-6 5.2-10"
            vector = broken(parent, name, clauses, pieces, Outcome(frames, refused), note)
            made.append(
                replace(vector, stored=False, splices=_fill(parent, vector.data, size + more))
            )
    return made


def _fill(parent: Valid, data: bytes, zeros: int) -> tuple[Splice, ...]:
    """The patch to the parent, with the zeros of the payload as one repeated byte."""
    place = parent.layout.offsets[1]
    header, rest = data[place : place + 20], data[place + 20 + zeros :]
    tail = len(parent.layout.data) - place
    return (Splice(place, 0, header), Splice(place, 0, b"\0", zeros), Splice(place, tail, rest))
