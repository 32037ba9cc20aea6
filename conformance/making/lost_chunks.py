"""Makes vectors in damaged/: chunks that are lost, repeated or reordered."""

from dataclasses import replace

from making.fault_rows import (
    RECOVERY_CLAUSES,
    count_frames,
    make_damaged_vector,
)
from making.streams import Layout, assemble
from making.vectors import Gap, Outcome, Recovery, ValidStream, Vector


def make_loss_vectors(parent: ValidStream) -> list[Vector]:
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
    vectors = [make_loss_vector(parent, f"damaged/lost-{n}", *case) for n, case in cases.items()]
    return [
        *vectors,
        _make_vector_without_both_ends(parent),
        _make_vector_with_two_rejections(parent),
    ]


def make_loss_vector(
    parent: ValidStream, name: str, lost_indices: list[int], frames_before: int, description: str
) -> Vector:
    """Return a stream with some consecutive chunks removed, and its expected output.

    Args:
        parent: The complete stream.
        name: Name of the vector.
        lost_indices: Indices of the chunks to remove.
        frames_before: Number of frames before the loss.
        description: Description of the lost chunks.
    """
    stream, chunks = parent.stream, parent.stream.drop_chunks(*lost_indices)
    layout = _assemble_without(parent, lost_indices)
    offsets = {
        chunk.sequence: offset for chunk, offset in zip(chunks, layout.offsets, strict=False)
    }
    next_chunk_index = lost_indices[-1] + 1
    resume_indices = (
        n
        for n in range(next_chunk_index, len(stream.chunks))
        if stream.chunks[n].kind in (b"CANO", b"TAIL")
    )
    resume_index = next(resume_indices)
    frames_lost: int | None = count_frames(stream.chunks[:resume_index]) - frames_before
    if frames_before == 0:
        frames_lost = None
    frames = (
        parent.frames[frames_before + (frames_lost or 0) :]
        if frames_lost is not None
        else _list_frames_after(parent, resume_index)
    )
    gap = Gap(
        offsets[next_chunk_index],
        offsets[resume_index] - offsets[next_chunk_index],
        ("sequence",),
        frames_lost,
    )
    outcome = Outcome(parent.frames[:frames_before], ("sequence",))
    recovery = Recovery([*parent.frames[:frames_before], *frames], (gap,))
    if frames_before == 0 and lost_indices == [2]:
        outcome = Outcome((), ("sequence",))
    return make_damaged_vector(
        parent,
        name,
        f"5.2-4 {RECOVERY_CLAUSES}",
        layout.data,
        outcome,
        recovery,
        f"the stream lacks {description}",
    )


def _make_vector_without_both_ends(parent: ValidStream) -> Vector:
    """Return a stream without its first CANO and last FRAM; the lost frames cannot be counted."""
    layout = _assemble_without(parent, [2, 12])
    offsets = layout.offsets  # of the parent's chunks 0, 1, 3 to 11, 13 and 14
    first_gap = Gap(offsets[2], offsets[4] - offsets[2], ("sequence",), None)
    last_gap = Gap(offsets[11], offsets[12] - offsets[11], ("sequence",), None)
    return make_damaged_vector(
        parent,
        "damaged/lost-first-canonical-and-last-frame",
        f"5.2-4 {RECOVERY_CLAUSES}",
        layout.data,
        Outcome((), ("sequence",)),
        Recovery(parent.frames[3:8], (first_gap, last_gap)),
        "the stream lacks the first CANO and the last FRAM",
    )


def _make_vector_with_two_rejections(parent: ValidStream) -> Vector:
    """Return a stream with two invalid CANO chunks; recovery also fails at the second."""
    chunks = list(parent.stream.chunks)
    for frame in (3, 6):
        payload = parent.stream.frame_payloads[frame]
        wrong_payload = replace(payload, state_crc=payload.state_crc ^ 1)
        chunk_index = parent.stream.frame_chunk_indices[frame]
        chunks[chunk_index] = replace(chunks[chunk_index], payload=wrong_payload.pack())
    layout = assemble(chunks)
    offsets = layout.offsets
    gaps = (
        Gap(offsets[5], offsets[9] - offsets[5], ("state-crc",), 3),
        Gap(offsets[9], offsets[14] - offsets[9], ("state-crc",), 3),
    )
    return make_damaged_vector(
        parent,
        "damaged/canonicals-rejected",
        f"9.2-1 {RECOVERY_CLAUSES}",
        layout.data,
        Outcome(parent.frames[:3], ("state-crc",)),
        Recovery(parent.frames[:3], gaps),
        "the states of the last two CANO do not match their CRCs",
    )


def _assemble_without(parent: ValidStream, lost_indices: list[int]):  # noqa: ANN202
    """Return the parent with some chunks removed; INDX and TAIL are unchanged."""
    data, offsets = parent.layout.data[:8], []
    for chunk_index in range(len(parent.stream.chunks)):
        if chunk_index not in lost_indices:
            offsets.append(len(data))
            data += parent.layout.data[
                parent.layout.offsets[chunk_index] : parent.layout.offsets[chunk_index + 1]
            ]
    return Layout(data, (*offsets, len(data)))


def _list_frames_after(parent: ValidStream, chunk_index: int) -> list:
    return parent.frames[count_frames(parent.stream.chunks[:chunk_index]) :]


def _reorder_chunks(parent: ValidStream, *order: int) -> bytes:
    """Return the stream with its chunks in the given order; they keep their sequence numbers."""
    data, offsets = parent.layout.data, parent.layout.offsets
    return data[:8] + b"".join(data[offsets[n] : offsets[n + 1]] for n in order)


def make_order_vectors(parent: ValidStream) -> list[Vector]:
    """Return streams with reordered or repeated chunks."""
    offsets, frames = parent.layout.offsets, parent.frames
    sizes = [offsets[n + 1] - offsets[n] for n in range(15)]
    gap_of_two = Gap(offsets[3], sum(sizes[3:5]), ("sequence",), 2)
    cases = {
        "frames": (
            (0, 1, 2, 4, 3, *range(5, 15)),
            1,
            [*frames[:1], *frames[3:]],
            gap_of_two,
            "two FRAM chunks are swapped",
        ),
        "frame-twice": (
            (0, 1, 2, 3, 3, *range(4, 15)),
            2,
            [*frames[:2], *frames[3:]],
            Gap(offsets[4], sizes[3] + sizes[4], ("sequence",), 1),
            "a FRAM is repeated",
        ),
        "canonical-twice": (
            (0, 1, 2, 3, 4, 5, 5, *range(6, 15)),
            4,
            [*frames[:4], *frames[6:]],
            Gap(offsets[6], sum(sizes[5:9]), ("sequence",), 2),
            "a CANO is repeated, so the second one has a lower sequence number than expected",
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
            Gap(offsets[9], sum(sizes[2:5]), ("sequence",), 0),
            "an earlier segment is repeated",
        ),
    }
    vectors = []
    for name, (order, frames_before, recovered_frames, gap, note) in cases.items():
        data = _reorder_chunks(parent, *order)
        gaps: tuple[Gap, ...] = (gap,)
        if name == "segments":
            offset = offsets[5] + sum(sizes[9:13])
            gaps = (gap, Gap(offset, sum(sizes[5:9]) + sizes[13], ("sequence",), 0))
        outcome = Outcome(frames[:frames_before], ("sequence",))
        vectors.append(
            make_damaged_vector(
                parent,
                f"damaged/order-{name}",
                f"5.2-4 {RECOVERY_CLAUSES}",
                data,
                outcome,
                Recovery(recovered_frames, gaps),
                note,
            )
        )
    return vectors
