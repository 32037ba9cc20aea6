"""invalid/: magic, version, features and fields of HEAD (SPEC 5.1, 5.3, 12)."""

from dataclasses import replace

from making.fault_rows import HEAD
from making.payloads import MAGIC
from making.vectors import Outcome, Recovery, Valid, Vector, broken


def make_beginnings(parent: Valid) -> list[Vector]:
    """Return patches of the journey whose fault is in the magic or in HEAD."""
    data, offsets = parent.layout.data, parent.layout.offsets
    head = parent.stream.pieces[HEAD].payload or b""
    others = {
        "magic": (b"\x88" + data[1:], "bad-magic", "5.1-1", "a bit of the first byte"),
        "magic-line-ends": (
            MAGIC.replace(b"\r\n", b"\n") + data[8:],
            "bad-magic",
            "5.1-1",
            "line ends that a transfer as text has turned",
        ),
        "magic-seven-bits": (b"\x09" + data[1:], "bad-magic", "5.1-1", "the eighth bit is lost"),
        "magic-missing": (data[8:], "bad-magic", "5.1-1", "the stream begins with HEAD"),
        "head-again": (
            MAGIC + data[8 : offsets[1]] + data[8:],
            "sequence chunk-order",
            "5.1-2 5.2-4",
            "HEAD comes twice, with one number",
        ),
    }
    vectors = [
        broken(parent, f"invalid/{name}", clauses, changed, Outcome((), tuple(ids.split())), note)
        for name, (changed, ids, clauses, note) in others.items()
    ]
    version, feature = bytes([2, 0]) + head[2:], head[:2] + b"\x01" + head[3:]
    heads = {
        "version-0": (b"\x00" + head[1:], "unsupported-version", "12-1", "version 0.0"),
        "version-2": (version, "unsupported-version", "12-1", "version 2.0"),
        "version-255": (b"\xff" + head[1:], "unsupported-version", "12-1", "version 255.0"),
        "version-2-longer": (
            version + bytes(20),
            "unsupported-version",
            "12-1 5.3-1",
            "version 2.0, with a longer HEAD",
        ),
        "version-2-other-fields": (
            version[:10] + b"\xee" * 30,
            "unsupported-version",
            "12-1 5.3-1",
            "version 2.0, with other fields",
        ),
        "feature": (feature, "unsupported-feature", "12-2", "bit 0 of incompatible_features"),
        "feature-31": (
            head[:5] + b"\x80" + head[6:],
            "unsupported-feature",
            "12-2",
            "bit 31 of incompatible_features",
        ),
        "feature-longer": (
            feature + b"\x01",
            "unsupported-feature",
            "12-2 5.3-1",
            "an unknown feature, with a field more in HEAD",
        ),
        "feature-other-level": (
            feature[:10] + b"\x63" + feature[11:],
            "unsupported-feature",
            "12-2 5.3-1",
            "an unknown feature, of a level that is none of ours",
        ),
        "head-beyond-1024": (
            head + bytes(1025 - len(head)),
            "chunk-exceeds-level",
            "5.2-7",
            "HEAD of 1025 bytes",
        ),
        "head-longer": (
            head + b"\0",
            "trailing-data",
            "5-2",
            "a byte after the last field of HEAD",
        ),
        "head-shorter": (head[:-1], "field", "5-1", "the last field of HEAD is missing"),
        "head-empty": (b"", "field", "5-1", "HEAD without fields"),
    }
    for name, (payload, ids, clauses, note) in heads.items():
        pieces = parent.stream.replaced(HEAD, payload=payload)
        said = Outcome((), (ids,))
        vector = broken(parent, f"invalid/{name}", clauses, pieces, said, note)
        vectors.append(replace(vector, recover=Recovery((), refused=(ids,))))
    return vectors


def make_head_faults(parent: Valid) -> list[Vector]:
    """Return streams with a field of HEAD outside of its range, patches of a brief stream."""
    vectors = []
    for name, value in HEAD_FAULTS:
        head = replace(parent.stream.head, **{name: value})
        pieces = parent.stream.replaced(HEAD, payload=head.pack())
        label = f"{value}".replace(".", "-").replace("+", "").replace("--", "-")
        outcome = Outcome((), ("field",))
        note = f"{name} is {value}"
        vectors.append(
            broken(
                parent,
                f"invalid/head-{name.replace('_', '-')}-{label}",
                "5-3",
                pieces,
                outcome,
                note,
            )
        )
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
