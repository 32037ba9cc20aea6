"""Makes vectors in invalid/: magic, version, features, fields of HEAD (SPEC 5.1, 5.3, 12)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import HEAD_CHUNK_INDEX
from making.payloads import MAGIC
from making.vectors import Outcome, Recovery, ValidStream, Vector, make_patched_vector

HeadCase = tuple[str, bytes, str, str, str]
"""Name, payload, reject id, clauses and description."""


def make_magic_and_head_faults(parent: ValidStream) -> list[Vector]:
    """Return patches of `streams/journey` with a fault in the magic or in HEAD."""
    return [*_make_magic_faults(parent), *_make_head_payload_faults(parent)]


def _make_magic_faults(parent: ValidStream) -> Iterable[Vector]:
    data, head_end = parent.layout.data, parent.layout.offsets[1]
    converted_magic, repeated_head = MAGIC.replace(b"\r\n", b"\n"), MAGIC + data[8:head_end]
    cases = {
        "magic": (b"\x88" + data[1:], "one bit of the first byte of the magic is flipped"),
        "magic-line-ends": (
            converted_magic + data[8:],
            "line endings of the magic are converted, as in a file transfer in text mode",
        ),
        "magic-seven-bits": (
            b"\x09" + data[1:],
            "the highest bit of the first byte of the magic is cleared",
        ),
        "magic-missing": (data[8:], "the stream begins with HEAD"),
    }
    for name, (changed_data, note) in cases.items():
        yield make_patched_vector(
            parent, f"invalid/{name}", "5.1-1", changed_data, Outcome((), ("bad-magic",)), note
        )
    outcome, note = (
        Outcome((), ("sequence", "chunk-order")),
        "HEAD is repeated with the same sequence number",
    )
    yield make_patched_vector(
        parent, "invalid/head-again", "5.1-2 5.2-4", repeated_head + data[8:], outcome, note
    )


def _make_head_payload_faults(parent: ValidStream) -> Iterable[Vector]:
    head = parent.stream.chunks[HEAD_CHUNK_INDEX].payload or b""
    for name, payload, reject_id, clauses, note in [
        *_list_version_faults(head),
        *_list_feature_faults(head),
        *_list_size_faults(head),
    ]:
        chunks, outcome = (
            parent.stream.replace_chunk(HEAD_CHUNK_INDEX, payload=payload),
            Outcome((), (reject_id,)),
        )
        vector = make_patched_vector(parent, f"invalid/{name}", clauses, chunks, outcome, note)
        yield replace(vector, recover=Recovery((), reject_ids=(reject_id,)))


def _list_version_faults(head: bytes) -> Iterable[HeadCase]:
    with_version_2, reject_id, parsing_clauses = (
        b"\2\0" + head[2:],
        "unsupported-version",
        "12-1 5.3-1",
    )
    other_fields = with_version_2[:10] + b"\xee" * 30
    yield "version-0", b"\0" + head[1:], reject_id, "12-1", "version 0.0"
    yield "version-2", with_version_2, reject_id, "12-1", "version 2.0"
    yield "version-255", b"\xff" + head[1:], reject_id, "12-1", "version 255.0"
    yield (
        "version-2-longer",
        with_version_2 + bytes(20),
        reject_id,
        parsing_clauses,
        "version 2.0, with a longer HEAD",
    )
    yield (
        "version-2-longest",
        with_version_2 + bytes(1024 - len(head)),
        reject_id,
        f"{parsing_clauses} 5.2-7",
        "version 2.0, with a HEAD of 1024 bytes",
    )
    yield (
        "version-2-other-fields",
        other_fields,
        reject_id,
        parsing_clauses,
        "version 2.0, with different fields",
    )


def _list_feature_faults(head: bytes) -> Iterable[HeadCase]:
    with_bit_0, with_bit_31 = head[:2] + b"\1" + head[3:], head[:5] + b"\x80" + head[6:]
    reject_id, parsing_clauses = "unsupported-feature", "12-2 5.3-1"
    with_other_level = with_bit_0[:10] + b"\x63" + with_bit_0[11:]
    yield "feature", with_bit_0, reject_id, "12-2", "bit 0 of incompatible_features is set"
    yield "feature-31", with_bit_31, reject_id, "12-2", "bit 31 of incompatible_features is set"
    yield (
        "feature-longer",
        with_bit_0 + b"\1",
        reject_id,
        parsing_clauses,
        "an unknown feature and an additional field",
    )
    yield (
        "feature-other-level",
        with_other_level,
        reject_id,
        parsing_clauses,
        "an unknown feature and level 99",
    )


def _list_size_faults(head: bytes) -> Iterable[HeadCase]:
    long_payload, reject_id = head + bytes(1025 - len(head)), "chunk-exceeds-level"
    yield "head-beyond-1024", long_payload, reject_id, "5.2-7", "HEAD of 1025 bytes"
    yield (
        "head-longer",
        head + b"\0",
        "trailing-data",
        "5-2",
        "an additional byte after the last field of HEAD",
    )
    yield "head-shorter", head[:-1], "field", "5-1", "the last field of HEAD is missing"
    yield "head-empty", b"", "field", "5-1", "the payload of HEAD is empty"


def make_head_faults(parent: ValidStream) -> list[Vector]:
    """Return patches of `streams/brief`, each with one field of HEAD out of range."""
    vectors = []
    for name, value in HEAD_FAULTS:
        head = replace(parent.stream.head, **{name: value})
        chunks = parent.stream.replace_chunk(HEAD_CHUNK_INDEX, payload=head.pack())
        label = f"{name}-{value}".replace("_", "-").replace(".", "-")
        outcome, note = Outcome((), ("field",)), f"{name} is {value}"
        vectors.append(
            make_patched_vector(parent, f"invalid/head-{label}", "5-3", chunks, outcome, note)
        )
    return vectors


_STEP_FIELDS = ("log_scale_step", "opacity_step", "sh_dc_step", "sh_rest_step")


HEAD_FAULTS: tuple[tuple[str, float], ...] = (
    *(("level", 0), ("level", 11), ("level", 32), ("timescale", 0), ("frame_ticks", 0)),
    *(("lattice_exponent", 25), ("position_step", 0), ("translation_step", 0)),
    *(("rotation_unity", 0), ("rotation_unity", 257), ("rotation_components", 2)),
    *(("rotation_components", 5), ("rotation_bits", 0), ("rotation_bits", 15)),
    *((step, 0.0) for step in _STEP_FIELDS),
    *((step, 1024.5) for step in _STEP_FIELDS),
    *(("log_scale_step", float("nan")), ("opacity_step", float("inf")), ("sh_dc_step", -0.125)),
    *(("sh_rest_step", float("nan")), ("sh_degree", 2), ("level_count", 0), ("level_count", 4)),
    *(("gaussians_per_anchor", 0), ("anchor_ratio", 0), ("anchor_ratio", 1)),
    *(("resample_interval", 0), ("full_crc_interval", 0), ("right_handed", 2), ("up_axis", 7)),
    *(("meters_per_unit", -1.0), ("meters_per_unit", float("nan")), ("meters_per_unit", 1000001.0)),
    *(("color_space", 0), ("color_space", 2)),
    *(("opacity_step", float("nan")), ("sh_dc_step", float("nan"))),
    *((step, -0.125) for step in ("log_scale_step", "opacity_step", "sh_rest_step")),
)
