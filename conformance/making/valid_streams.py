"""streams/: one feature for each stream."""

from making.changes import Change, Coded
from making.motion_streams import make_lives, make_motions
from making.payloads import Head, pack_camera, pack_cameras, pack_metadata
from making.scenes import between, cloud, moving, newborn, only, state_some
from making.snapshot_streams import make_snapshots
from making.streams import Stream
from making.update_streams import make_updates
from making.vectors import Outcome, Valid, valid

_CAMERA = pack_camera()


def journey() -> Valid:
    """The parent of most faults: frames 0 to 8, canonical 0, 3 and 6, ancillary chunks, INDX."""
    head = Head(rotation_components=4, rotation_unity=1, sh_degree=1, level_count=2)
    stream = Stream(head).add(b"came", pack_cameras(_CAMERA))
    for frame in (0, 3, 6):
        stream.canonical(frame, cloud(12, frame, reach=20))
        if frame == 3:
            stream.add(b"meta", pack_metadata(("title", "before frame 4")))
        stream.frame(Change(moving(7, frame + 1)))
        if frame == 6:
            stream.add(b"note", b"an ancillary chunk of a type that nobody knows")
        stream.frame(Change(moving(7, frame + 2), newborn([2, 7], frame), deaths=1))
    stream.end(index=True)
    made = valid("streams/journey", "a little of everything; the parent of most faults", "", stream)
    seek = tuple((f, Outcome(made.frames[f:])) for f in range(1, 9))
    note = "canonical frames 0, 3 and 6, motion, births, deaths, ancillary chunks, index"
    return valid("streams/journey", note, "1-1 1-2 11.2-1", stream, seek=seek, grow=True)


def brief() -> Valid:
    """The parent of truncations: three frames of one Gaussian."""
    stream = Stream(Head(level_count=1, sh_degree=0)).canonical(0, [Coded((3, -2, 1))])
    stream.frame(Change(only((1, 0, [1, 0, 0, 0, 0, 2]))))
    stream.frame(Change(only((1, 0, [0, -1, 0, 0, 0, 0])))).end()
    return valid("streams/brief", "three frames of one Gaussian, no index", "7.1 6.1", stream)


def make_streams() -> list[Valid]:
    """Return all streams."""
    return [
        *(journey(), brief(), *_containers(), *_scenes()),
        *(*make_motions(), *make_lives(), *make_updates(), *make_snapshots()),
    ]


def _still(**fields: object) -> Stream:
    degree = fields.get("sh_degree", 1)
    return Stream(Head(**fields)).canonical(0, cloud(6, degree=degree))  # type: ignore[arg-type]


def _containers() -> list[Valid]:
    return [*_without_frames(), _metadata(), _ancillaries(), *_headers(), *_ordinals(), *_fields()]


def _without_frames() -> list[Valid]:
    bare, indexed = Stream(Head()).end(), Stream(Head()).end(index=True)
    return [
        valid("streams/no-frames", "a stream without frames is valid", "5.1-4", bare),
        valid("streams/no-frames-index", "INDX without seek points", "5.9-1", indexed),
        valid("streams/still", "one canonical frame", "7.2-1 7.2-2 9.2-1", _still().end()),
    ]


def _metadata() -> Valid:
    meta = pack_metadata(("title", "Große Straße \u0000 \ufeff 日本"), ("title", "again"), ("", ""))
    stream = Stream(Head()).add(b"meta", pack_metadata())
    stream.add(b"came", pack_cameras(_CAMERA, _CAMERA)).canonical(0, cloud(3))
    stream.add(b"meta", meta).add(b"came", pack_cameras()).frame()
    stream.add(b"came", pack_cameras(_CAMERA)).add(b"meta", meta).end()
    note = "`came` and `meta` anywhere and more than once, U+0000, an empty key"
    return valid("streams/cameras-and-metadata", note, "5-4", stream)


def _ancillaries() -> Valid:
    stream = Stream(Head()).add(b"nOte", b"").add(b"zZzz", b"\xff" * 9).canonical(0, cloud(2))
    stream.add(b"note", pack_metadata()[:1]).frame().end(index=True)
    note = "ancillary chunks of unknown types, including private ones"
    return valid("streams/unknown-ancillary", note, "5.2-8 5.2-10", stream, grow=True)


def _headers() -> list[Valid]:
    feature, minor = _still(compatible_features=0x80000001), _still(version_minor=7)
    note = "unknown bits of compatible_features"
    return [
        valid("streams/compatible-feature", note, "12-3", feature.end()),
        valid("streams/minor-version", "a later minor version", "12-1", minor.end()),
    ]


def _ordinals() -> list[Valid]:
    late = Stream(Head()).canonical(4294967294, cloud(2)).frame().end(index=True)
    last = ((4294967295, Outcome([late.decoded()[1]])), (1, Outcome(late.decoded())))
    twice = Stream(Head()).canonical(7, cloud(4)).canonical(8, cloud(5, 2)).frame().end(index=True)
    second, sync = ((8, Outcome(twice.decoded()[1:])),), bytes.fromhex("9E5143F3")
    inside = Stream(Head()).add(b"note", sync + b"CANO" + sync * 3).canonical(0, cloud(2)).end()
    name, note = (
        "streams/canonical-after-canonical",
        "two canonical frames in a row, from ordinal 7 on",
    )
    return [
        valid("streams/last-ordinals", "ordinals up to 2^32 - 1", "7.4-2", late, seek=last),
        valid(name, note, "7.2-1 11.2-4", twice, seek=second),
        valid("streams/sync-in-a-payload", "sync words within a payload", "5.2-1", inside),
    ]


_GREATEST = {
    **dict.fromkeys(("timescale", "frame_ticks"), 4294967295),
    **dict.fromkeys(("position_step", "translation_step", "gaussians_per_anchor"), 65535),
    **dict.fromkeys(("anchor_ratio", "resample_interval", "full_crc_interval"), 65535),
    "lattice_exponent": 24,
    "rotation_unity": 256,
    "rotation_bits": 14,
    "up_axis": 6,
    "log_scale_step": 1024.0,
    "seed": (1 << 64) - 1,
    "meters_per_unit": 1e6,
}


def _fields() -> list[Valid]:
    greatest, least = _still(**_GREATEST).frame().end(), _least()
    note = "minimum values of fields of HEAD; a subnormal step; meters_per_unit -0"
    return [
        valid("streams/largest-fields", "maximum values of fields of HEAD", "5-3", greatest),
        valid("streams/least-fields", note, "5-3", least),
    ]


def _least() -> Stream:
    least = {"timescale": 1, "lattice_exponent": 0, "position_step": 1, "translation_step": 1}
    least |= {"rotation_unity": 1, "rotation_bits": 1, "sh_degree": 0, "level_count": 1}
    least |= {"gaussians_per_anchor": 1, "resample_interval": 1, "full_crc_interval": 1, "seed": 0}
    steps = {"log_scale_step": 1e-45, "opacity_step": 1e-45, "meters_per_unit": -0.0}
    small = [Coded((0, 0, 0), (0, 1, 0, 0)), Coded((1, 0, 0), (1, 0, -1, 0))]
    stream = Stream(Head(**least, **steps, right_handed=0)).canonical(0, small)  # type: ignore[arg-type]
    return stream.frame(Change(only((1, 1, [1, 0, 0, 0, 0, -1])))).end()


def _scenes() -> list[Valid]:
    far = [Coded((-524288,) * 3), Coded((524287,) * 3), Coded((0, 1, 77))]
    one = [Coded((-5, 9, 2), codes=cloud(4)[i].codes) for i in range(4)]
    codes = [(32767, -32767, 0, 32767, 16384, 0, -16383, *[32767, -32767] * 4, 0), (-1,) * 16]
    extreme = [Coded((i, 0, 0), codes=c) for i, c in enumerate(codes)]
    turned = [Coded((i, i, 0), (i % 4, *c)) for i, c in enumerate(_TURNED)]
    return [
        valid("streams/sh-degree-0", "Gaussians of 7 codes", "7.1", _still(sh_degree=0).end()),
        valid(
            "streams/sh-rest",
            "SH rest of many magnitudes, which use all classes of contexts",
            "8.5",
            Stream(Head()).canonical(0, _rest()).end(),
        ),
        valid(
            "streams/one-place",
            "axis_bits 0: all Gaussians at one position",
            "8.5-1",
            Stream(Head()).canonical(0, one).end(),
        ),
        valid(
            "streams/wide-box",
            "axis_bits 20: the widest box, position_step 1",
            "8.5-1 7.2-3",
            Stream(Head(position_step=1)).canonical(0, far).end(),
        ),
        valid(
            "streams/extreme-codes",
            "codes of the greatest magnitude",
            "7.2-4",
            Stream(Head()).canonical(0, extreme).end(),
        ),
        valid(
            "streams/rotations",
            "indices j that are not the largest component's, components at their limit",
            "7.2-5 7.2-6",
            Stream(Head()).canonical(0, turned).end(),
        ),
        valid(
            "streams/stated",
            "every context states a probability",
            "8.2-1",
            Stream(Head())
            .canonical(0, cloud(9), state_some)
            .frame(Change(moving(6, 3), newborn([1, 2], 4), stating=state_some))
            .end(),
        ),
        valid(
            "streams/stated-codes",
            "stated codes 0, 119, 120 and 239",
            "8.2-1",
            Stream(Head()).canonical(0, cloud(9), _state_ends).end(),
        ),
        valid(
            "streams/roomy-box",
            "axis_bits and origin larger than the positions need",
            "8.5-1",
            Stream(Head()).canonical(0, cloud(5), origin=(-90, -80, -70), axis_bits=19).end(),
        ),
    ]


_TURNED = (
    *((0, 0, 0), (256, 0, 0), (0, -256, 0), (0, 0, 256), (181, 181, 0), (-181, 0, 181), (1, 2, 3)),
    *((147, 147, -147), (-147, 147, 148), (255, 22, 0), (128, 128, 128), (90, -90, 200)),
)


def _rest() -> list[Coded]:
    clouds = cloud(40, 77)
    rest = [
        tuple(between(-(1 << (i % 11)), 1 << (i % 11), i, k) for k in range(9)) for i in range(40)
    ]
    return [
        Coded(g.position, g.rotation, g.codes[:7] + r) for g, r in zip(clouds, rest, strict=True)
    ]


def _state_ends(_model: str, context: int, zeros: int, ones: int) -> int | None:
    choices = [239, 119, None] + ([0] if not ones else []) + ([120] if not zeros else [])
    return choices[(context + zeros) % len(choices)]
