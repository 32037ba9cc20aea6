"""Makes the streams in levels/, at a limit of their level or 1 beyond it (SPEC 3.2)."""

import zlib
from dataclasses import replace

from making.changes import Change, CodedGaussian, Update
from making.payloads import Frame, Head
from making.planes import make_update_planes
from making.scenes import make_cloud, make_moving_symbols
from making.snapshot_scenes import REQUIRED_CAPABILITY as REQUIRES_SNAPSHOTS
from making.snapshot_scenes import make_snapshot_head
from making.streams import Chunk, Stream
from making.update_scenes import REQUIRED_CAPABILITY, make_update_head
from making.vectors import (
    Outcome,
    Splice,
    ValidStream,
    Vector,
    make_patched_vector,
    make_valid_stream,
)
from making.writing import Planes, WritingSection
from plain.updates import read_updates

LEVEL_LIMITS = {10: (65536, 4096, 1 << 22), 20: (262144, 16384, 1 << 24)}
_GAUSSIAN_AT_ORIGIN = CodedGaussian((0, 0, 0), codes=(0,) * 7)
_HEAD_FIELDS = {"level": 10, "sh_degree": 0, "level_count": 1, "gaussians_per_anchor": 65535}


def make_level_streams() -> list[ValidStream]:
    """Return the streams that are within the limits of their levels."""
    max_gaussians, max_births, _ = LEVEL_LIMITS[10]
    full_stream = _append_death_and_birth(
        Stream(Head(**_HEAD_FIELDS)).add_canonical(0, [_GAUSSIAN_AT_ORIGIN] * max_gaussians)
    )
    max_births_stream = Stream(Head(level=10, sh_degree=0)).add_canonical(
        0, [_GAUSSIAN_AT_ORIGIN] * 5
    )
    max_births_stream.add_frame(Change(births=(_GAUSSIAN_AT_ORIGIN,) * max_births))
    more_births_stream = Stream(Head(level=20, sh_degree=0)).add_canonical(
        0, [_GAUSSIAN_AT_ORIGIN] * 5
    )
    more_births_stream.add_frame(Change(births=(_GAUSSIAN_AT_ORIGIN,) * (max_births + 1)))
    updated_stream = _append_update_and_birth(
        Stream(make_update_head(**_HEAD_FIELDS)).add_canonical(
            0, [_GAUSSIAN_AT_ORIGIN] * max_gaussians
        )
    )
    snapshot_stream = Stream(make_snapshot_head(level=10, sh_degree=0)).add_canonical(
        0, [_GAUSSIAN_AT_ORIGIN] * 5
    )
    snapshot_stream.add_snapshot((), [_GAUSSIAN_AT_ORIGIN] * (max_births + 1))
    streams = [
        make_valid_stream(
            "levels/10-newborn",
            "a snapshot with more newborn Gaussians than level 1.0 allows births in a frame",
            "3.2-3 3.2-6",
            snapshot_stream.finish(),
            **REQUIRES_SNAPSHOTS,
        ),
        make_valid_stream(
            "levels/10-updates",
            "as many Gaussians as level 1.0 allows; an update deletes one, another is born",
            "3.2-1 3.2-2 7.8",
            updated_stream.finish(),
            **REQUIRED_CAPABILITY,
        ),
        make_valid_stream(
            "levels/10-gaussians",
            "as many Gaussians as level 1.0 allows, in a few bytes; one dies, another is born",
            "3.2-1 3.2-2",
            full_stream.finish(),
        ),
        make_valid_stream(
            "levels/10-births",
            "the maximum number of births of level 1.0",
            "3.2-3",
            max_births_stream.finish(),
        ),
        make_valid_stream(
            "levels/20-births",
            "more births than level 1.0 allows, at level 2.0",
            "3.2-3",
            more_births_stream.finish(),
        ),
    ]
    for level in (10, 20, 30, 31):
        stream = (
            Stream(Head(level=level))
            .add_canonical(0, make_cloud(4))
            .add_frame(Change(make_moving_symbols(6, level)))
        )
        streams.append(
            make_valid_stream(
                f"levels/{level}", f"level {level} in HEAD", "1-1", stream.finish(index=True)
            )
        )
    return streams


def _append_death_and_birth(stream: Stream) -> Stream:
    """Append a frame in which one of many equal Gaussians dies and another is born.

    Nothing moves and all coded bits are 0, so the frame can be written without decoding
    65536 Gaussians.
    """
    previous = stream.states[0]
    assert previous is not None
    newborn = replace(previous.gaussians[0], id=len(previous.gaussians))
    gaussians = [*previous.gaussians[1:], newborn]
    state = replace(previous, frame=1, phase=1, gaussians=gaussians, next_id=newborn.id + 1)
    crc = zlib.crc32(state.serialize(codes=False))
    stream.frame_chunk_indices.append(len(stream.chunks))
    stream.chunks.append(Chunk(b"FRAM", Frame(1, 0, 1, 1, (), (), crc).pack()))
    stream.states.append(state)
    return stream


def _append_update_and_birth(stream: Stream) -> Stream:
    """Append a frame in which an update deletes one of many equal Gaussians and another is born.

    Only the updates section is encoded by the slow coder in `plain`; the state is set directly.
    """
    previous = stream.states[0]
    assert previous is not None
    gaussian_count = len(previous.gaussians)
    section = WritingSection(
        "updates", Planes(make_update_planes(gaussian_count, (Update(0, None),))), {}
    )
    read_updates(section, previous.gaussians)
    section.close()
    newborn = replace(previous.gaussians[0], id=gaussian_count, recency=0)
    gaussians = [*previous.gaussians[1:], newborn]
    state = replace(previous, frame=1, phase=1, gaussians=gaussians, next_id=gaussian_count + 1)
    crc = zlib.crc32(state.serialize(codes=False))
    stream.frame_chunk_indices.append(len(stream.chunks))
    frame = Frame(1, 0, 0, 1, (), (), crc, tuple(section.written_words))
    stream.chunks.append(Chunk(b"FRAM", frame.pack()))
    stream.states.append(state)
    return stream


def make_large_payload_vectors(levels: list[ValidStream]) -> list[Vector]:
    """Return streams with payloads at the limit of a level or 1 byte longer.

    The streams are not stored as files, but generated on demand.
    """
    vectors = []
    for level, (_, _, size) in LEVEL_LIMITS.items():
        parent = next(
            level_stream for level_stream in levels if level_stream.vector.name == f"levels/{level}"
        )
        for extra_bytes, reject_ids in ((0, ()), (1, ("chunk-exceeds-level",))):
            chunks = parent.stream.insert_chunks(Chunk(b"note", bytes(size + extra_bytes)), index=1)
            frames = [] if reject_ids else parent.frames
            name = f"levels/{level}-payload" + ("-beyond" if extra_bytes else "")
            comparison = "one more than" if extra_bytes else "the most that"
            note = (
                f"an ancillary payload of {size + extra_bytes} bytes, {comparison} the level allows"
            )
            clauses = "3.2-4 5.2-6 5.2-10"
            vector = make_patched_vector(
                parent, name, clauses, chunks, Outcome(frames, reject_ids), note
            )
            vectors.append(
                replace(
                    vector,
                    is_stored=False,
                    splices=_make_zero_splices(parent, vector.data, size + extra_bytes),
                )
            )
    return vectors


def _make_zero_splices(parent: ValidStream, data: bytes, zero_count: int) -> tuple[Splice, ...]:
    """Return the splices that turn the parent into the stream `data`.

    The zeros of the payload are stored as one repeated byte.
    """
    offset = parent.layout.offsets[1]
    header, data_after = data[offset : offset + 20], data[offset + 20 + zero_count :]
    replaced_size = len(parent.layout.data) - offset
    return (
        Splice(offset, 0, header),
        Splice(offset, 0, b"\0", zero_count),
        Splice(offset, replaced_size, data_after),
    )
