"""damaged/: chunks that are lost, repeated or reordered."""

from dataclasses import replace

from making.fault_rows import (
    RECOVERY_CLAUSES,
    count_frames,
    damaged_by,
)
from making.streams import Layout, assemble
from making.vectors import Gap, Outcome, Recovery, Valid, Vector


def make_losses(parent: Valid) -> list[Vector]:
    """Return streams with missing chunks."""
    cases = {
        "cameras": ([1], 0, "`came`"),
        "first-canonical": ([2], 0, "the first CANO"),
        "frame": ([4], 2, "a FRAM"),
        "last-frame-of-a-segment": ([8], 5, "the FRAM before a CANO"),
        "canonical": ([5], 3, "a CANO"),
        "canonical-and-frames": ([5, 6, 7, 8], 3, "a CANO and all frames that depend on it"),
        "two-segments": ([4, 5, 6, 7], 2, "chunks of two segments"),
        "metadata": ([6], 4, "`meta`"),
        "last-frame": ([12], 8, "the last FRAM"),
        "index": ([13], 9, "INDX"),
    }
    losses = [lose(parent, f"damaged/lost-{n}", *case) for n, case in cases.items()]
    return [*losses, _drop_both_ends(parent), _reject_two_canonicals(parent)]


def lose(parent: Valid, name: str, gone: list[int], before: int, what: str) -> Vector:
    """Return a stream without some of its chunks, and with frames before them."""
    stream, pieces = parent.stream, parent.stream.without(*gone)
    layout = _assemble_lost(parent, gone)
    offsets = {piece.sequence: at for piece, at in zip(pieces, layout.offsets, strict=False)}
    first = gone[-1] + 1
    stops = (
        n for n in range(first, len(stream.pieces)) if stream.pieces[n].kind in (b"CANO", b"TAIL")
    )
    later = next(stops)
    lost: int | None = count_frames(stream.pieces[:later]) - before
    if before == 0:
        lost = None
    frames = parent.frames[before + (lost or 0) :] if lost is not None else _after(parent, later)
    gap = Gap(offsets[first], offsets[later] - offsets[first], ("sequence",), lost)
    said = Outcome(parent.frames[:before], ("sequence",))
    recovery = Recovery([*parent.frames[:before], *frames], (gap,))
    if before == 0 and gone == [2]:
        said = Outcome((), ("sequence",))
    return damaged_by(
        parent, name, f"5.2-4 {RECOVERY_CLAUSES}", layout.data, said, recovery, f"lost: {what}"
    )


def _drop_both_ends(parent: Valid) -> Vector:
    """TAIL counts from the first frame of the stream, which is unknown."""
    layout = _assemble_lost(parent, [2, 12])
    offsets = layout.offsets  # of pieces 0, 1, 3 to 11, 13, 14
    first = Gap(offsets[2], offsets[4] - offsets[2], ("sequence",), None)
    last = Gap(offsets[11], offsets[12] - offsets[11], ("sequence",), None)
    return damaged_by(
        parent,
        "damaged/lost-first-canonical-and-last-frame",
        f"5.2-4 {RECOVERY_CLAUSES}",
        layout.data,
        Outcome((), ("sequence",)),
        Recovery(parent.frames[3:8], (first, last)),
        "lost: the first CANO, and the last FRAM",
    )


def _reject_two_canonicals(parent: Valid) -> Vector:
    """The frame at which decoding resumed is missing as well, if it is rejected."""
    pieces = list(parent.stream.pieces)
    for frame in (3, 6):
        payload = parent.stream.payloads[frame]
        spoiled = replace(payload, state_crc=payload.state_crc ^ 1)
        place = parent.stream.places[frame]
        pieces[place] = replace(pieces[place], payload=spoiled.pack())
    layout = assemble(pieces)
    offsets = layout.offsets
    gaps = (
        Gap(offsets[5], offsets[9] - offsets[5], ("state-crc",), 3),
        Gap(offsets[9], offsets[14] - offsets[9], ("state-crc",), 3),
    )
    return damaged_by(
        parent,
        "damaged/canonicals-rejected",
        f"9.2-1 {RECOVERY_CLAUSES}",
        layout.data,
        Outcome(parent.frames[:3], ("state-crc",)),
        Recovery(parent.frames[:3], gaps),
        "the states of the last two CANO do not match their CRCs",
    )


def _assemble_lost(parent: Valid, gone: list[int]):  # noqa: ANN202
    """The bytes of the journey without some chunks; INDX and TAIL are unchanged."""
    data, offsets = parent.layout.data[:8], []
    for place in range(len(parent.stream.pieces)):
        if place not in gone:
            offsets.append(len(data))
            data += parent.layout.data[
                parent.layout.offsets[place] : parent.layout.offsets[place + 1]
            ]
    return Layout(data, (*offsets, len(data)))


def _after(parent: Valid, place: int) -> list:
    return parent.frames[count_frames(parent.stream.pieces[:place]) :]


def _chunks(parent: Valid, *order: int) -> bytes:
    """Chunks of the journey in another order, with their own sequence numbers."""
    data, offsets = parent.layout.data, parent.layout.offsets
    return data[:8] + b"".join(data[offsets[n] : offsets[n + 1]] for n in order)


def make_orders(parent: Valid) -> list[Vector]:
    """Reordered and repeated chunks."""
    offsets, frames = parent.layout.offsets, parent.frames
    size = [offsets[n + 1] - offsets[n] for n in range(15)]
    skip = Gap(offsets[3], sum(size[3:5]), ("sequence",), 2)
    cases = {
        "frames": (
            (0, 1, 2, 4, 3, *range(5, 15)),
            1,
            [*frames[:1], *frames[3:]],
            skip,
            "two FRAM chunks are swapped",
        ),
        "frame-twice": (
            (0, 1, 2, 3, 3, *range(4, 15)),
            2,
            [*frames[:2], *frames[3:]],
            Gap(offsets[4], size[3] + size[4], ("sequence",), 1),
            "a FRAM is repeated",
        ),
        "canonical-twice": (
            (0, 1, 2, 3, 4, 5, 5, *range(6, 15)),
            4,
            [*frames[:4], *frames[6:]],
            Gap(offsets[6], sum(size[5:9]), ("sequence",), 2),
            "a CANO is repeated: the second has an earlier number",
        ),
        "segments": (
            (0, 1, 2, 3, 4, 9, 10, 11, 12, 5, 6, 7, 8, 13, 14),
            3,
            [*frames[:3], *frames[6:]],
            Gap(offsets[5], 0, ("sequence",), 3),
            "two segments are swapped",
        ),
        "old-segment-again": (
            (*range(9), *range(2, 5), *range(9, 15)),
            6,
            frames,
            Gap(offsets[9], sum(size[2:5]), ("sequence",), 0),
            "an earlier segment is repeated",
        ),
    }
    vectors = []
    for name, (order, before, out, gap, note) in cases.items():
        data = _chunks(parent, *order)
        gaps: tuple[Gap, ...] = (gap,)
        if name == "segments":
            place = offsets[5] + sum(size[9:13])
            gaps = (gap, Gap(place, sum(size[5:9]) + size[13], ("sequence",), 0))
        said = Outcome(frames[:before], ("sequence",))
        vectors.append(
            damaged_by(
                parent,
                f"damaged/order-{name}",
                f"5.2-4 {RECOVERY_CLAUSES}",
                data,
                said,
                Recovery(out, gaps),
                note,
            )
        )
    return vectors
