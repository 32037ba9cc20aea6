"""invalid/: magic, version, features and fields of HEAD (SPEC 5.1, 5.3, 12)."""

from collections.abc import Iterable
from dataclasses import replace

from making.fault_rows import HEAD
from making.payloads import MAGIC
from making.vectors import Outcome, Recovery, Valid, Vector, broken

HeadCase = tuple[str, bytes, str, str, str]
"""Name, payload, reject id, clauses and description."""


def make_beginnings(parent: Valid) -> list[Vector]:
    """Return patches of the journey with a fault in the magic or in HEAD."""
    return [*_of_magic(parent), *_of_heads(parent)]


def _of_magic(parent: Valid) -> Iterable[Vector]:
    data, first = parent.layout.data, parent.layout.offsets[1]
    as_text, twice = MAGIC.replace(b"\r\n", b"\n"), MAGIC + data[8:first]
    cases = {
        "magic": (b"\x88" + data[1:], "a bit of the first byte"),
        "magic-line-ends": (as_text + data[8:], "line ends converted by a transfer as text"),
        "magic-seven-bits": (b"\x09" + data[1:], "the eighth bit is lost"),
        "magic-missing": (data[8:], "the stream begins with HEAD"),
    }
    for name, (there, note) in cases.items():
        yield broken(parent, f"invalid/{name}", "5.1-1", there, Outcome((), ("bad-magic",)), note)
    said, note = Outcome((), ("sequence", "chunk-order")), "HEAD is repeated with the same number"
    yield broken(parent, "invalid/head-again", "5.1-2 5.2-4", twice + data[8:], said, note)


def _of_heads(parent: Valid) -> Iterable[Vector]:
    head = parent.stream.pieces[HEAD].payload or b""
    for name, payload, ids, clauses, note in [
        *_of_versions(head),
        *_of_features(head),
        *_of_sizes(head),
    ]:
        pieces, said = parent.stream.replaced(HEAD, payload=payload), Outcome((), (ids,))
        vector = broken(parent, f"invalid/{name}", clauses, pieces, said, note)
        yield replace(vector, recover=Recovery((), refused=(ids,)))


def _of_versions(head: bytes) -> Iterable[HeadCase]:
    other, ids, parsed = b"\2\0" + head[2:], "unsupported-version", "12-1 5.3-1"
    strange = other[:10] + b"\xee" * 30
    yield "version-0", b"\0" + head[1:], ids, "12-1", "version 0.0"
    yield "version-2", other, ids, "12-1", "version 2.0"
    yield "version-255", b"\xff" + head[1:], ids, "12-1", "version 255.0"
    yield "version-2-longer", other + bytes(20), ids, parsed, "version 2.0, with a longer HEAD"
    yield "version-2-other-fields", strange, ids, parsed, "version 2.0, with other fields"


def _of_features(head: bytes) -> Iterable[HeadCase]:
    first, last = head[:2] + b"\1" + head[3:], head[:5] + b"\x80" + head[6:]
    ids, parsed = "unsupported-feature", "12-2 5.3-1"
    strange = first[:10] + b"\x63" + first[11:]
    yield "feature", first, ids, "12-2", "bit 0 of incompatible_features"
    yield "feature-31", last, ids, "12-2", "bit 31 of incompatible_features"
    yield (
        "feature-longer",
        first + b"\1",
        ids,
        parsed,
        "an unknown feature, and an additional field",
    )
    yield "feature-other-level", strange, ids, parsed, "an unknown feature, and level 99"


def _of_sizes(head: bytes) -> Iterable[HeadCase]:
    long, ids = head + bytes(1025 - len(head)), "chunk-exceeds-level"
    yield "head-beyond-1024", long, ids, "5.2-7", "HEAD of 1025 bytes"
    yield "head-longer", head + b"\0", "trailing-data", "5-2", "a byte after the last field"
    yield "head-shorter", head[:-1], "field", "5-1", "the last field of HEAD is missing"
    yield "head-empty", b"", "field", "5-1", "HEAD without fields"


def make_head_faults(parent: Valid) -> list[Vector]:
    """Return patches of a brief stream with a field of HEAD out of range."""
    vectors = []
    for name, value in HEAD_FAULTS:
        head = replace(parent.stream.head, **{name: value})
        pieces = parent.stream.replaced(HEAD, payload=head.pack())
        label = f"{name}-{value}".replace("_", "-").replace(".", "-")
        said, note = Outcome((), ("field",)), f"{name} is {value}"
        vectors.append(broken(parent, f"invalid/head-{label}", "5-3", pieces, said, note))
    return vectors


_STEPS = ("log_scale_step", "opacity_step", "sh_dc_step", "sh_rest_step")


HEAD_FAULTS: tuple[tuple[str, float], ...] = (
    *(("level", 0), ("level", 11), ("level", 32), ("timescale", 0), ("frame_ticks", 0)),
    *(("lattice_exponent", 25), ("position_step", 0), ("translation_step", 0)),
    *(("rotation_unity", 0), ("rotation_unity", 257), ("rotation_components", 2)),
    *(("rotation_components", 5), ("rotation_bits", 0), ("rotation_bits", 15)),
    *((step, 0.0) for step in _STEPS),
    *((step, 1024.5) for step in _STEPS),
    *(("log_scale_step", float("nan")), ("opacity_step", float("inf")), ("sh_dc_step", -0.125)),
    *(("sh_rest_step", float("nan")), ("sh_degree", 2), ("level_count", 0), ("level_count", 4)),
    *(("gaussians_per_anchor", 0), ("anchor_ratio", 0), ("anchor_ratio", 1)),
    *(("resample_interval", 0), ("full_crc_interval", 0), ("right_handed", 2), ("up_axis", 7)),
    *(("meters_per_unit", -1.0), ("meters_per_unit", float("nan")), ("meters_per_unit", 1000001.0)),
    *(("color_space", 0), ("color_space", 2)),
)
