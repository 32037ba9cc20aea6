"""Makes the valid streams in streams/; each tests one feature."""

from typing import Any

from making.changes import Change, CodedGaussian
from making.motion_streams import make_birth_and_death_streams, make_motion_streams
from making.payloads import Head, pack_camera, pack_cameras, pack_metadata
from making.scenes import (
    choose_varied_codes,
    make_births,
    make_cloud,
    make_moving_symbols,
    pick_between,
    select_symbols,
)
from making.seek_streams import make_outside_seek_streams
from making.snapshot_streams import make_snapshot_streams
from making.streams import Stream
from making.text_streams import make_metadata_stream, make_text_stream
from making.update_streams import make_update_streams
from making.vectors import Outcome, ValidStream, make_valid_stream

_CAMERA = pack_camera()


def make_journey() -> ValidStream:
    """Return the parent of most faults; frames 0, 3 and 6 of its 9 frames are canonical."""
    head = Head(rotation_components=4, rotation_unity=1, sh_degree=1, level_count=2)
    stream = Stream(head).add_chunk(b"came", pack_cameras(_CAMERA))
    for frame in (0, 3, 6):
        stream.add_canonical(frame, make_cloud(12, frame, limit=20))
        if frame == 3:
            stream.add_chunk(b"meta", pack_metadata(("title", "before frame 4")))
        stream.add_frame(Change(make_moving_symbols(7, frame + 1)))
        if frame == 6:
            stream.add_chunk(b"note", b"an ancillary chunk of a type that nobody knows")
        stream.add_frame(
            Change(make_moving_symbols(7, frame + 2), make_births([2, 7], frame), death_count=1)
        )
    stream.finish(index=True)
    without_seek = make_valid_stream("streams/journey", "", "", stream)
    seek = tuple((f, Outcome(without_seek.frames[f:])) for f in range(1, 9))
    note = "canonical frames 0, 3 and 6, motion, births, deaths, ancillary chunks, INDX"
    return make_valid_stream(
        "streams/journey", note, "1-1 1-2 11.2-1", stream, seek=seek, grow=True
    )


def make_brief() -> ValidStream:
    """Return a stream of three frames of one Gaussian, which is later cut at every byte."""
    stream = Stream(Head(level_count=1, sh_degree=0)).add_canonical(0, [CodedGaussian((3, -2, 1))])
    stream.add_frame(Change(select_symbols((1, 0, [1, 0, 0, 0, 0, 2]))))
    stream.add_frame(Change(select_symbols((1, 0, [0, -1, 0, 0, 0, 0])))).finish()
    return make_valid_stream(
        "streams/brief", "three frames of one Gaussian, without INDX", "7.1 6.1", stream
    )


def make_streams() -> list[ValidStream]:
    """Return all streams."""
    return [
        *(make_journey(), make_brief(), *_make_container_streams(), *_make_scene_streams()),
        *(
            *make_motion_streams(),
            *make_birth_and_death_streams(),
            *make_update_streams(),
            *make_snapshot_streams(),
        ),
    ]


def _make_still_stream(**fields: Any) -> Stream:
    sh_degree = fields.get("sh_degree", 1)
    return Stream(Head(**fields)).add_canonical(0, make_cloud(6, sh_degree=sh_degree))


def _make_container_streams() -> list[ValidStream]:
    return [
        *_make_streams_without_motion(),
        make_metadata_stream(),
        _make_ancillary_stream(),
        *_make_header_streams(),
        *_make_ordinal_streams(),
        *_make_field_extreme_streams(),
        make_text_stream(),
        *make_outside_seek_streams(),
    ]


def _make_streams_without_motion() -> list[ValidStream]:
    empty_stream, indexed_stream = Stream(Head()).finish(), Stream(Head()).finish(index=True)
    return [
        make_valid_stream(
            "streams/no-frames", "a stream without frames is valid", "5.1-4", empty_stream
        ),
        make_valid_stream(
            "streams/no-frames-index", "INDX without seek points", "5.9-1", indexed_stream
        ),
        make_valid_stream(
            "streams/still",
            "one canonical frame",
            "7.2-1 7.2-2 9.2-1",
            _make_still_stream().finish(),
        ),
    ]


def _make_ancillary_stream() -> ValidStream:
    stream = (
        Stream(Head())
        .add_chunk(b"nOte", b"")
        .add_chunk(b"zZzz", b"\xff" * 9)
        .add_canonical(0, make_cloud(2))
    )
    stream.add_chunk(b"note", pack_metadata()[:1]).add_frame().finish(index=True)
    note = "ancillary chunks of unknown types, including private ones"
    return make_valid_stream("streams/unknown-ancillary", note, "5.2-8 5.2-10", stream, grow=True)


def _make_header_streams() -> list[ValidStream]:
    feature_stream, minor_stream = (
        _make_still_stream(compatible_features=0x80000001),
        _make_still_stream(version_minor=7),
    )
    note = "unknown bits of compatible_features"
    return [
        make_valid_stream("streams/compatible-feature", note, "12-3", feature_stream.finish()),
        make_valid_stream(
            "streams/minor-version", "a later minor version", "12-1", minor_stream.finish()
        ),
    ]


def _make_ordinal_streams() -> list[ValidStream]:
    last_ordinals_stream = (
        Stream(Head()).add_canonical(4294967294, make_cloud(2)).add_frame().finish(index=True)
    )
    last_ordinals_seek = (
        (4294967295, Outcome([last_ordinals_stream.list_decoded_frames()[1]])),
        (1, Outcome(last_ordinals_stream.list_decoded_frames())),
    )
    two_canonicals_stream = (
        Stream(Head())
        .add_canonical(7, make_cloud(4))
        .add_canonical(8, make_cloud(5, 2))
        .add_frame()
        .finish(index=True)
    )
    second_seek, sync_word = (
        ((8, Outcome(two_canonicals_stream.list_decoded_frames()[1:])),),
        bytes.fromhex("9E5143F3"),
    )
    sync_stream = (
        Stream(Head())
        .add_chunk(b"note", sync_word + b"CANO" + sync_word * 3)
        .add_canonical(0, make_cloud(2))
        .finish()
    )
    name, note = (
        "streams/canonical-after-canonical",
        "two consecutive canonical frames; the first ordinal is 7",
    )
    return [
        make_valid_stream(
            "streams/last-ordinals",
            "ordinals up to 2^32 - 1",
            "7.4-2",
            last_ordinals_stream,
            seek=last_ordinals_seek,
        ),
        make_valid_stream(name, note, "7.2-1 11.2-4", two_canonicals_stream, seek=second_seek),
        make_valid_stream(
            "streams/sync-in-a-payload", "sync words within a payload", "5.2-1", sync_stream
        ),
    ]


_MAXIMUM_HEAD_FIELDS = {
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


def _make_field_extreme_streams() -> list[ValidStream]:
    maximum_stream, minimum_stream = (
        _make_still_stream(**_MAXIMUM_HEAD_FIELDS).add_frame().finish(),
        _make_minimum_field_stream(),
    )
    note = "the smallest values of HEAD fields, including subnormal steps and meters_per_unit -0"
    return [
        make_valid_stream(
            "streams/largest-fields", "the largest values of HEAD fields", "5-3", maximum_stream
        ),
        make_valid_stream("streams/least-fields", note, "5-3", minimum_stream),
    ]


def _make_minimum_field_stream() -> Stream:
    fields: dict[str, Any] = {"timescale": 1, "lattice_exponent": 0}
    fields |= {"position_step": 1, "translation_step": 1}
    fields |= {"rotation_unity": 1, "rotation_bits": 1, "sh_degree": 0, "level_count": 1}
    fields |= {"gaussians_per_anchor": 1, "resample_interval": 1, "full_crc_interval": 1, "seed": 0}
    float_fields = {"log_scale_step": 1e-45, "opacity_step": 1e-45, "meters_per_unit": -0.0}
    gaussians = [CodedGaussian((0, 0, 0), (0, 1, 0, 0)), CodedGaussian((1, 0, 0), (1, 0, -1, 0))]
    stream = Stream(Head(**fields, **float_fields, right_handed=0)).add_canonical(0, gaussians)
    return stream.add_frame(Change(select_symbols((1, 1, [1, 0, 0, 0, 0, -1])))).finish()


def _make_scene_streams() -> list[ValidStream]:
    far_corners = [
        CodedGaussian((-524288,) * 3),
        CodedGaussian((524287,) * 3),
        CodedGaussian((0, 1, 77)),
    ]
    gaussians_at_one_position = [
        CodedGaussian((-5, 9, 2), codes=make_cloud(4)[i].codes) for i in range(4)
    ]
    code_rows = [(32767, -32767, 0, 32767, 16384, 0, -16383, *[32767, -32767] * 4, 0), (-1,) * 16]
    extreme_gaussians = [CodedGaussian((i, 0, 0), codes=c) for i, c in enumerate(code_rows)]
    rotated_gaussians = [
        CodedGaussian((i, i, 0), (i % 4, *c)) for i, c in enumerate(_ROTATION_COMPONENTS)
    ]
    return [
        make_valid_stream(
            "streams/sh-degree-0",
            "Gaussians without SH rest (7 codes)",
            "7.1",
            _make_still_stream(sh_degree=0).finish(),
        ),
        make_valid_stream(
            "streams/sh-rest",
            "SH rest codes of many magnitudes, which use all context classes",
            "8.5",
            Stream(Head()).add_canonical(0, _make_sh_rest_scene()).finish(),
        ),
        make_valid_stream(
            "streams/one-place",
            "all Gaussians are at one position, so axis_bits is 0",
            "8.5-1",
            Stream(Head()).add_canonical(0, gaussians_at_one_position).finish(),
        ),
        make_valid_stream(
            "streams/wide-box",
            "the widest box of positions (axis_bits 20, position_step 1)",
            "8.5-1 7.2-3",
            Stream(Head(position_step=1)).add_canonical(0, far_corners).finish(),
        ),
        make_valid_stream(
            "streams/extreme-codes",
            "codes of the largest magnitude",
            "7.2-4",
            Stream(Head()).add_canonical(0, extreme_gaussians).finish(),
        ),
        make_valid_stream(
            "streams/rotations",
            "rotations whose component j is not the largest, and components at their limit",
            "7.2-5 7.2-6",
            Stream(Head()).add_canonical(0, rotated_gaussians).finish(),
        ),
        make_valid_stream(
            "streams/stated",
            "every context states a probability code",
            "8.2-1",
            Stream(Head())
            .add_canonical(0, make_cloud(9), choose_varied_codes)
            .add_frame(
                Change(
                    make_moving_symbols(6, 3),
                    make_births([1, 2], 4),
                    choose_code=choose_varied_codes,
                )
            )
            .finish(),
        ),
        make_valid_stream(
            "streams/stated-codes",
            "stated probability codes 0, 119, 120 and 239",
            "8.2-1",
            Stream(Head()).add_canonical(0, make_cloud(9), _choose_extreme_codes).finish(),
        ),
        make_valid_stream(
            "streams/roomy-box",
            "axis_bits and the distance to the origin are larger than needed",
            "8.5-1",
            Stream(Head())
            .add_canonical(0, make_cloud(5), origin=(-90, -80, -70), axis_bits=19)
            .finish(),
        ),
    ]


_ROTATION_COMPONENTS = (
    *((0, 0, 0), (256, 0, 0), (0, -256, 0), (0, 0, 256), (181, 181, 0), (-181, 0, 181), (1, 2, 3)),
    *((147, 147, -147), (-147, 147, 148), (255, 22, 0), (128, 128, 128), (90, -90, 200)),
)


def _make_sh_rest_scene() -> list[CodedGaussian]:
    gaussians = make_cloud(40, 77)
    sh_rest = [
        tuple(pick_between(-(1 << (i % 11)), 1 << (i % 11), i, k) for k in range(9))
        for i in range(40)
    ]
    return [
        CodedGaussian(g.position, g.rotation, g.codes[:7] + r)
        for g, r in zip(gaussians, sh_rest, strict=True)
    ]


def _choose_extreme_codes(_model: str, context: int, zeros: int, ones: int) -> int | None:
    choices = [239, 119, None] + ([0] if not ones else []) + ([120] if not zeros else [])
    return choices[(context + zeros) % len(choices)]
