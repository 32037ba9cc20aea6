"""streams/: motion, births and deaths, one feature for each stream."""

from making.changes import Change
from making.payloads import Head
from making.scenes import between, cloud, moving, newborn
from making.streams import Stream
from making.vectors import Valid, valid


def make_motions() -> list[Valid]:
    """Return streams with motion."""
    return [*_of_header_fields(), *_of_symbols()]


def _moved(stream: Stream, frames: int, seed: int = 0) -> Stream:
    """Move a stream's scene for a number of frames."""
    channels = 3 + stream.head.rotation_components
    for frame in range(1, frames + 1):
        stream.frame(Change(moving(channels, seed + frame)))
    return stream.end()


def _of_header_fields() -> list[Valid]:
    made = []
    for levels in (1, 2, 3):
        stream = Stream(Head(level_count=levels)).canonical(0, cloud(17, levels))
        name, note = f"streams/levels-of-anchors-{levels}", f"{levels} of 3 levels of anchors"
        made.append(valid(name, note, "6.1 6.3 7.5 8.7", _moved(stream, 4, 10 * levels)))
    for interval in (1, 3):
        stream = Stream(Head(resample_interval=interval)).canonical(0, cloud(15, 5))
        name, note = f"streams/resample-{interval}", f"sampling every {interval} frames"
        made.append(valid(name, note, "7.4 6.5 7.4-1", _moved(stream, 7)))
    crc = Stream(Head(full_crc_interval=3)).canonical(0, cloud(6))
    note = "a CRC over all fields every 3 frames"
    made.append(valid("streams/full-crc-3", note, "9.2-1", _moved(crc, 6)))
    return [*made, *(_previous(flag) for flag in (0, 1))]


def _previous(flag: int) -> Valid:
    stream = Stream(Head(rotation_components=4)).canonical(0, cloud(20, 6))
    for frame in range(1, 6):
        stream.frame(Change(moving(7, frame // 2), previous=flag))
    note = f"previous_contexts {flag} throughout"
    return valid(f"streams/previous-contexts-{flag}", note, "8.7", stream.end())


def _of_symbols() -> list[Valid]:
    along = Stream(Head()).canonical(0, cloud(9))
    along.frame(Change(lambda level, anchor: [level, -anchor, 1, 0, 0, 0])).end()
    around = Stream(Head()).canonical(0, cloud(9))
    around.frame(Change(lambda level, anchor: [0, 0, 0, level, -anchor, 1])).frame().end()
    limit = Stream(Head(level_count=3, rotation_components=4)).canonical(0, cloud(12))
    for frame in range(3):
        limit.frame(Change(lambda _level, anchor, s=frame: [(-1) ** (s + anchor) * 65] * 7))
    wide = Stream(Head(level_count=1, gaussians_per_anchor=1)).canonical(0, cloud(26, 8))
    for frame in range(1, 5):
        wide.frame(Change(moving(6, frame, one_in=1, reach=24)))
    uneven = Stream(Head(gaussians_per_anchor=4, anchor_ratio=3))
    uneven.canonical(0, cloud(41, 9, reach=400)).frame(Change(moving(6, 8))).end()
    sizes = "symbols of all sizes, which use all classes of magnitudes"
    counts = "rounded numbers of anchors: m = 4, r = 3"
    limits = "symbols of magnitude 65 at all levels"
    return [
        valid("streams/translation", "translation alone", "7.5", along),
        valid("streams/rotation", "only rotation, then a frame without motion", "7.5", around),
        valid("streams/greatest-symbols", limits, "8.7 7.5-1", limit.end()),
        valid("streams/wide-symbols", sizes, "8.7", wide.end()),
        valid("streams/uneven-anchors", counts, "6.1", uneven),
    ]


def make_lives() -> list[Valid]:
    """Return streams with births and deaths."""
    births = Stream(Head()).canonical(0, cloud(8))
    births.frame(Change(births=newborn([0, 3, 3, 7], 1))).frame(Change(moving(6, 4)))
    births.frame(Change(births=newborn([8, 9, 11], 2))).frame(Change(moving(6, 5))).end()
    flat = Stream(Head(sh_degree=0)).canonical(0, cloud(8, degree=0))
    flat.frame(Change(moving(6, 6), newborn([1, 2], 3, 0))).frame(Change(moving(6, 7))).end()
    deaths = Stream(Head()).canonical(0, cloud(14, 3))
    for count in (1, 0, 4, 8):
        deaths.frame(Change(moving(6, count), deaths=count))
    churn = Stream(Head(resample_interval=3)).canonical(0, cloud(10, 4))
    for frame in range(1, 9):
        parents = [between(0, 7, frame, k) for k in range(frame % 3)]
        churn.frame(Change(moving(6, frame), newborn(parents, frame), deaths=(frame % 4) // 2))
    return [
        valid(
            "streams/births",
            "births, bound and moved in the next frame",
            "7.6-1 7.6-2 7.6-3 7.6-4",
            births,
        ),
        valid("streams/births-sh-degree-0", "births with 7 codes", "7.6-3", flat),
        valid("streams/deaths", "Gaussians leave, down to one", "7.4-3", deaths.end()),
        valid(
            "streams/births-and-deaths",
            "births and deaths over several samplings",
            "7.4-3 7.6-1",
            churn.end(),
        ),
    ]
