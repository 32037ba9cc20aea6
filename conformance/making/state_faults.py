"""Makes vectors in invalid/: frames whose state is invalid (SPEC 7, 9)."""

import zlib
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from making.changes import Change, CodedGaussian
from making.fault_rows import (
    CANO_CHUNK_INDEX,
    FRAM_CHUNK_INDEX,
    FRAM_ORDINAL,
    FaultRow,
    make_faults_at,
    replace_frame_fields,
)
from making.frames import make_canonical, make_frame
from making.scenes import make_births, make_cloud, make_moving_symbols
from making.streams import Chunk
from making.vectors import Outcome, ValidStream, Vector, make_patched_vector
from plain.state import PlainState

_ROTATION_ONE = 1 << 8  # 2^rotation_bits of the journey
_WRONG_COLOR_NOTE = "32768, the sum of green and the coded difference"
WrongGaussian = tuple[str, str, str, dict[str, Any], str]
"""Name, clauses, reject id, changed fields of a coded Gaussian, and description."""

_WRONG_BIRTHS: tuple[WrongGaussian, ...] = (
    (
        "parent-far-beyond",
        "7.6-1",
        "parent-range",
        {"parent": 1 << 40},
        "the index of a parent is 2^40",
    ),
    (
        *("parent-greatest-difference", "7.6-1 8.4-1", "parent-range", {"parent": 1 << 60}),
        "the index of a parent is 2^60, which is also the largest difference that is allowed",
    ),
    (
        *("parent-wraps", "7.6-1 4.1-1", "parent-range", {"parent": 1 << 32}),
        "the index of a parent is 2^32, which is 0 in 32 bits",
    ),
    (
        *("newborn-rotation", "7.6-4", "rotation-range", {"rotation": (0, _ROTATION_ONE, 1, 0)}),
        "a rotation whose norm is slightly above 1",
    ),
    (
        *(
            "newborn-component",
            "7.6-4",
            "rotation-range",
            {"rotation": (0, _ROTATION_ONE + 1, 0, 0)},
        ),
        "a rotation component of magnitude above 1",
    ),
)
_WRONG_ROTATIONS: tuple[WrongGaussian, ...] = (
    (
        *("rotation", "7.2-6", "rotation-range", {"rotation": (2, _ROTATION_ONE, 0, 1)}),
        "a rotation whose norm is slightly above 1",
    ),
    (
        *(
            "rotation-component",
            "7.2-5",
            "rotation-range",
            {"rotation": (1, 0, -_ROTATION_ONE - 1, 0)},
        ),
        "a rotation component of magnitude above 1",
    ),
    (
        *(
            "rotation-long",
            "7.2-6",
            "rotation-range",
            {"rotation": (3, _ROTATION_ONE, _ROTATION_ONE, -_ROTATION_ONE)},
        ),
        "three rotation components of magnitude 1",
    ),
)
_WRONG_SCALES = (
    (
        *("newborn-scale", (-32767, -32766, -32768)),
        "a log-scale is -32768, the sum of coded differences",
    ),
    (
        *("newborn-scale-y", (32767, 65534, 32767)),
        "only the log-scale of y, from which that of z is computed, is out of range",
    ),
    (
        *("newborn-scale-wraps", (32767, 65534, 65534)),
        "the log-scales of y and z are 65534, which is -2 in 16 bits",
    ),
)


def make_state_faults(parent: ValidStream) -> list[Vector]:
    """Return patches of `streams/journey` with an invalid state in frame 3 or 4."""
    return [
        *make_faults_at(
            parent, FRAM_CHUNK_INDEX, [*_list_newborn_faults(parent), *_list_crc_faults(parent)]
        ),
        *make_faults_at(
            parent,
            CANO_CHUNK_INDEX,
            [*_list_position_faults(parent), *_list_gaussian_faults(parent)],
        ),
    ]


def _get_previous_state(parent: ValidStream) -> PlainState:
    state = parent.stream.states[FRAM_ORDINAL - 1]
    assert state is not None
    return state


def _replace_frame(parent: ValidStream, change: Change) -> list[Chunk]:
    frame, _ = make_frame(parent.stream.head, _get_previous_state(parent), change)
    return parent.stream.replace_chunk(FRAM_CHUNK_INDEX, payload=frame.pack())


def _list_newborn_faults(parent: ValidStream) -> Iterable[FaultRow]:
    first, second = make_births([0, 5], 40)
    codes, count = second.codes, len(_get_previous_state(parent).gaussians)

    def make_chunks(**fields: Any) -> list[Chunk]:
        return _replace_frame(parent, Change(births=(first, replace(second, **fields))))

    with_canceled_identity = _replace_frame(
        parent, Change(lambda _level, _anchor: [0, 0, 0, -1, 0, 0, 0])
    )
    note = "the w residuals cancel the identity, so the vector to normalize is 0"
    yield "degenerate-rotation", "7.3-1", "degenerate-rotation", with_canceled_identity, note
    note = "the parent is a Gaussian born in the same frame"
    yield "parent-beyond", "7.6-1", "parent-range", make_chunks(parent=count), note
    for name, clauses, reject_id, fields, note in _WRONG_BIRTHS:
        yield name, clauses, reject_id, make_chunks(**fields), note
    for name, wrong_codes, note in _list_wrong_codes("newborn-code", codes):
        yield name, "7.6-3", "code-range", make_chunks(codes=wrong_codes), note
    for name, scales, note in _WRONG_SCALES:
        chunks = make_chunks(codes=(*scales, *codes[3:]))
        yield name, "7.6-3", "code-range", chunks, note


def _list_wrong_codes(
    name: str, codes: tuple[int, ...]
) -> Iterable[tuple[str, tuple[int, ...], str]]:
    """Yield codes with a color out of range whose difference from green is in range."""
    rows = (
        ("", (32768, 1, 1), f"red is {_WRONG_COLOR_NOTE}"),
        ("-negative", (1, -1, -32768), f"blue is -{_WRONG_COLOR_NOTE}"),
        ("-wraps", (65534, 32767, 0), "red is 65534, which is -2 in 16 bits"),
        ("-wraps-negative", (0, -32767, -65534), "blue is -65534, which is 2 in 16 bits"),
    )
    for suffix, colors, note in rows:
        yield f"{name}{suffix}", (*codes[:4], *colors, *codes[7:]), note


def _list_crc_faults(parent: ValidStream) -> Iterable[FaultRow]:
    state, frame = parent.stream.states[FRAM_ORDINAL], parent.stream.frame_payloads[FRAM_ORDINAL]
    assert state is not None
    crcs = {
        "state-crc": (frame.state_crc ^ 1, "9.2-1 9.2-2", "one bit of the state CRC is flipped"),
        "state-crc-of-the-codes": (
            *(zlib.crc32(state.serialize()), "9.2-1"),
            "the state CRC covers all fields instead of all but the codes",
        ),
        "state-crc-zero": (0, "9.2-1", "the state CRC is 0, which does not mean that it is absent"),
    }
    for name, (crc, clauses, note) in crcs.items():
        yield (
            name,
            clauses,
            "state-crc",
            replace_frame_fields(parent, FRAM_ORDINAL, state_crc=crc),
            note,
        )
    other_frame, _ = make_frame(
        parent.stream.head, _get_previous_state(parent), Change(make_moving_symbols(7, 99))
    )
    chunks = replace_frame_fields(parent, FRAM_ORDINAL, motion=other_frame.motion)
    yield (
        "state-of-another-frame",
        "9.2-1",
        "state-crc",
        chunks,
        "the motion section is that of another frame",
    )


def make_wrapping_rotation(parent: ValidStream) -> Vector:
    """Return a patch of `streams/least-fields` with the square of a component that is 2^64."""
    gaussians = [CodedGaussian((0, 0, 0), (0, 0, -2048, 0)), CodedGaussian((1, 0, 0))]
    canonical, _ = make_canonical(parent.stream.head, 0, gaussians)
    return make_patched_vector(
        parent,
        "invalid/rotation-wraps",
        "7.2-5 7.2-6 4.1-1",
        parent.stream.replace_chunk(1, payload=canonical.pack()),
        Outcome((), ("rotation-range",)),
        "a rotation component is -2^32, whose square is 0 modulo 2^64",
    )


def _replace_canonical(parent: ValidStream, gaussians: Iterable[CodedGaussian]) -> list[Chunk]:
    canonical, _ = make_canonical(parent.stream.head, 3, list(gaussians))
    return parent.stream.replace_chunk(CANO_CHUNK_INDEX, payload=canonical.pack())


def _list_position_faults(parent: ValidStream) -> Iterable[FaultRow]:
    gaussians, position_limit = make_cloud(12, 3, limit=20), 1 << 21  # position_step is 4
    values = [v for g in gaussians for v in g.position]

    def shift_scene(offset: int) -> list[Chunk]:
        shifted_positions = ((g, tuple(v + offset for v in g.position)) for g in gaussians)
        return _replace_canonical(
            parent,
            (replace(g, position=shifted_position) for g, shifted_position in shifted_positions),
        )

    with_wrapped_origin = replace_frame_fields(parent, 3, origin=(1 << 30, 0, 0))
    cases = {
        "position": (
            shift_scene(position_limit - max(values)),
            "a position just beyond the lattice",
        ),
        "position-negative": (
            shift_scene(-position_limit - min(values)),
            "a position of -2^23, which 24 bits could hold",
        ),
        "position-wraps": (
            with_wrapped_origin,
            "an origin whose coordinate is 2^32 lattice units, which is 0 in 32 bits",
        ),
    }
    for name, (chunks, note) in cases.items():
        yield name, "7.2-3 4.1-1", "position-range", chunks, note


def _list_gaussian_faults(parent: ValidStream) -> Iterable[FaultRow]:
    *other_gaussians, last = make_cloud(12, 3, limit=20)
    for name, codes, note in _list_wrong_codes("code", last.codes):
        chunks = _replace_canonical(parent, [*other_gaussians, replace(last, codes=codes)])
        yield name, "7.2-4", "code-range", chunks, note
    for name, clauses, reject_id, fields, note in _WRONG_ROTATIONS:
        yield (
            name,
            clauses,
            reject_id,
            _replace_canonical(parent, [*other_gaussians, replace(last, **fields)]),
            note,
        )


_MOTION_FAULTS: dict[str, tuple[list[int], str]] = {
    "moved-beyond": ([1, 0, 0, 0, 0, 0], "a Gaussian moves just beyond the lattice"),
    "moved-beyond-negative": (
        [0, -1, 0, 0, 0, 0],
        "a Gaussian moves just beyond the lattice in the negative direction",
    ),
    "moved-far-beyond": ([0, 0, 65, 0, 0, 0], "a Gaussian moves far beyond the lattice"),
}


def make_motion_faults(parent: ValidStream) -> list[Vector]:
    """Return streams whose last frame moves a Gaussian, or creates one, outside the lattice."""
    previous = parent.stream.states[-1]
    assert previous is not None
    x_positions = [g.position[0] for g in previous.gaussians]
    newborn_beyond = replace(
        make_births([x_positions.index(max(x_positions))], 1, 0)[0], position=(1, 0, 0)
    )
    vectors = [
        _make_last_frame_fault(parent, name, "7.5-1", Change(_repeat_symbols(symbols)), note)
        for name, (symbols, note) in _MOTION_FAULTS.items()
    ]
    note = "a Gaussian is born just beyond the lattice"
    return [
        *vectors,
        _make_last_frame_fault(
            parent, "newborn-beyond", "7.6-2", Change(births=(newborn_beyond,)), note
        ),
    ]


def _repeat_symbols(symbols: list[int]) -> Callable[[int, int], list[int]]:
    return lambda _level, _anchor: symbols


def _make_last_frame_fault(
    parent: ValidStream, name: str, clause: str, change: Change, note: str
) -> Vector:
    """Return the parent with an additional last frame, which decoders must reject."""
    stream, previous = parent.stream, parent.stream.states[-1]
    assert previous is not None
    frame, _ = make_frame(stream.head, previous, change)
    chunks = stream.insert_chunks(Chunk(b"FRAM", frame.pack()), index=len(stream.chunks) - 1)
    outcome = Outcome(parent.frames, ("position-range",))
    return make_patched_vector(parent, f"invalid/{name}", f"{clause} 4.1-1", chunks, outcome, note)
