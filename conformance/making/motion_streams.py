"""Makes streams in streams/; each tests one feature of motion, births or deaths."""

from making.changes import Change
from making.payloads import Head
from making.scenes import make_births, make_cloud, make_moving_symbols, pick_between
from making.streams import Stream
from making.vectors import ValidStream, make_valid_stream


def make_motion_streams() -> list[ValidStream]:
    """Return streams with motion."""
    return [*_make_header_streams(), *_make_symbol_streams()]


def _append_motion_frames(stream: Stream, frame_count: int, seed: int = 0) -> Stream:
    """Append `frame_count` frames with motion, and finish the stream."""
    channels = 3 + stream.head.rotation_components
    for frame in range(1, frame_count + 1):
        stream.add_frame(Change(make_moving_symbols(channels, seed + frame)))
    return stream.finish()


def _make_header_streams() -> list[ValidStream]:
    streams = []
    for levels in (1, 2, 3):
        stream = Stream(Head(level_count=levels)).add_canonical(0, make_cloud(17, levels))
        name, note = (
            f"streams/levels-of-anchors-{levels}",
            f"{levels} of the 3 possible anchor levels",
        )
        streams.append(
            make_valid_stream(
                name, note, "6.1 6.3 7.5 8.7", _append_motion_frames(stream, 4, 10 * levels)
            )
        )
    for interval in (1, 3):
        stream = Stream(Head(resample_interval=interval)).add_canonical(0, make_cloud(15, 5))
        name, note = f"streams/resample-{interval}", f"resample_interval is {interval}"
        streams.append(
            make_valid_stream(name, note, "7.4 6.5 7.4-1", _append_motion_frames(stream, 7))
        )
    crc_stream = Stream(Head(full_crc_interval=3)).add_canonical(0, make_cloud(6))
    note = "the state CRC covers all fields every 3 frames"
    streams.append(
        make_valid_stream("streams/full-crc-3", note, "9.2-1", _append_motion_frames(crc_stream, 6))
    )
    return [*streams, *(_make_previous_contexts_stream(flag) for flag in (0, 1))]


def _make_previous_contexts_stream(flag: int) -> ValidStream:
    stream = Stream(Head(rotation_components=4)).add_canonical(0, make_cloud(20, 6))
    for frame in range(1, 6):
        stream.add_frame(Change(make_moving_symbols(7, frame // 2), previous_contexts=flag))
    note = f"previous_contexts is {flag} in every frame"
    return make_valid_stream(f"streams/previous-contexts-{flag}", note, "8.7", stream.finish())


def _make_symbol_streams() -> list[ValidStream]:
    translation_stream = Stream(Head()).add_canonical(0, make_cloud(9))
    translation_stream.add_frame(
        Change(lambda level, anchor: [level, -anchor, 1, 0, 0, 0])
    ).finish()
    rotation_stream = Stream(Head()).add_canonical(0, make_cloud(9))
    rotation_stream.add_frame(
        Change(lambda level, anchor: [0, 0, 0, level, -anchor, 1])
    ).add_frame().finish()
    limit_stream = Stream(Head(level_count=3, rotation_components=4)).add_canonical(
        0, make_cloud(12)
    )
    for frame in range(3):
        limit_stream.add_frame(
            Change(lambda _level, anchor, s=frame: [(-1) ** (s + anchor) * 65] * 7)
        )
    wide_stream = Stream(Head(level_count=1, gaussians_per_anchor=1)).add_canonical(
        0, make_cloud(26, 8)
    )
    for frame in range(1, 5):
        wide_stream.add_frame(
            Change(make_moving_symbols(6, frame, anchors_per_moving_anchor=1, limit=24))
        )
    uneven_stream = Stream(Head(gaussians_per_anchor=4, anchor_ratio=3))
    uneven_stream.add_canonical(0, make_cloud(41, 9, limit=400)).add_frame(
        Change(make_moving_symbols(6, 8))
    ).finish()
    wide_note = "symbols of so many magnitudes that all context classes of magnitudes occur"
    uneven_note = (
        "the numbers of anchors are rounded quotients (gaussians_per_anchor 4, anchor_ratio 3)"
    )
    limit_note = "symbols of magnitude 65 at all levels"
    return [
        make_valid_stream(
            "streams/translation", "motion without rotation", "7.5", translation_stream
        ),
        make_valid_stream(
            "streams/rotation",
            "motion without translation, then a frame without motion",
            "7.5",
            rotation_stream,
        ),
        make_valid_stream(
            "streams/greatest-symbols", limit_note, "8.7 7.5-1", limit_stream.finish()
        ),
        make_valid_stream("streams/wide-symbols", wide_note, "8.7", wide_stream.finish()),
        make_valid_stream("streams/uneven-anchors", uneven_note, "6.1", uneven_stream),
    ]


def make_birth_and_death_streams() -> list[ValidStream]:
    """Return streams with births and deaths."""
    births_stream = Stream(Head()).add_canonical(0, make_cloud(8))
    births_stream.add_frame(Change(births=make_births([0, 3, 3, 7], 1))).add_frame(
        Change(make_moving_symbols(6, 4))
    )
    births_stream.add_frame(Change(births=make_births([8, 9, 11], 2))).add_frame(
        Change(make_moving_symbols(6, 5))
    ).finish()
    degree_0_stream = Stream(Head(sh_degree=0)).add_canonical(0, make_cloud(8, sh_degree=0))
    degree_0_stream.add_frame(
        Change(make_moving_symbols(6, 6), make_births([1, 2], 3, 0))
    ).add_frame(Change(make_moving_symbols(6, 7))).finish()
    deaths_stream = Stream(Head()).add_canonical(0, make_cloud(14, 3))
    for count in (1, 0, 4, 8):
        deaths_stream.add_frame(Change(make_moving_symbols(6, count), death_count=count))
    churn_stream = Stream(Head(resample_interval=3)).add_canonical(0, make_cloud(10, 4))
    for frame in range(1, 9):
        parents = [pick_between(0, 7, frame, k) for k in range(frame % 3)]
        churn_stream.add_frame(
            Change(
                make_moving_symbols(6, frame),
                make_births(parents, frame),
                death_count=(frame % 4) // 2,
            )
        )
    return [
        make_valid_stream(
            "streams/births",
            "new Gaussians are bound and moved in the next frame",
            "7.6-1 7.6-2 7.6-3 7.6-4",
            births_stream,
        ),
        make_valid_stream(
            "streams/births-sh-degree-0",
            "births of Gaussians without SH rest (7 codes)",
            "7.6-3",
            degree_0_stream,
        ),
        make_valid_stream(
            "streams/deaths", "Gaussians die until one is left", "7.4-3", deaths_stream.finish()
        ),
        make_valid_stream(
            "streams/births-and-deaths",
            "births and deaths across several samplings of anchors",
            "7.4-3 7.6-1",
            churn_stream.finish(),
        ),
    ]
