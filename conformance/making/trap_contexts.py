"""Makes vectors in traps/ for contexts, counts and words (SPEC 8)."""

from making.changes import Change, CodedGaussian, choose_no_code
from making.payloads import Head
from making.scenes import (
    choose_some_codes,
    choose_varied_codes,
    make_births,
    make_cloud,
    make_moving_symbols,
)
from making.streams import Stream
from making.trap_making import make_trap_streams
from making.vectors import ValidStream

_ZEROS = [0] * 6


def make_context_traps() -> list[ValidStream]:
    """Return the traps for contexts."""
    return make_trap_streams(
        (
            ("counts-are-halved", make_halved_counts, "8.2"),
            ("moving-without-symbols", make_moving_anchors_without_symbols, "8.7"),
            ("stillness-is-counted", make_counted_planes_without_words, "8.2 8.7"),
            ("stated-planes-are-counted", make_counted_planes_with_codes, "8.1 8.2"),
            ("canonical-forgets", make_counts_reset_by_canonical, "7.2 8.2"),
            ("words-of-zero", make_zero_words, "8.3-1"),
            ("against-expectation", make_reversing_motion, "8.7"),
            ("greatest-motion-again", make_repeated_greatest_motion, "7.1 8.7"),
        )
    )


def make_halved_counts() -> Stream:
    """A context counts more than 4096 bits, so its counts are halved."""
    stream = Stream(Head(level_count=1)).add_canonical(0, make_cloud(4, 11))
    for frame in range(2):
        stream.add_frame(
            Change(make_moving_symbols(6, frame), make_births([k % 4 for k in range(470)], frame))
        )
    return stream


def make_moving_anchors_without_symbols() -> Stream:
    """Some anchors are coded as moving although all their symbols are 0."""
    stream = Stream(Head(level_count=2)).add_canonical(0, make_cloud(20, 12))
    stream.add_frame(Change(lambda _level, anchor: _ZEROS if anchor % 3 else None))
    return stream.add_frame(
        Change(lambda _level, anchor: _ZEROS if anchor % 2 else [1, *_ZEROS[1:]])
    )


def make_counted_planes_without_words() -> Stream:
    """The planes of a section that has no words are added to the counts."""
    stream = Stream(Head(level_count=2)).add_canonical(0, make_cloud(30, 13, limit=300))
    for _ in range(5):
        stream.add_frame()
    return (
        stream.add_frame(Change(make_moving_symbols(6, 1)))
        .add_frame()
        .add_frame(Change(make_moving_symbols(6, 2)))
    )


def make_counted_planes_with_codes() -> Stream:
    """The bits of a context are counted, too, if its probability is stated."""
    stream = Stream(Head(level_count=2)).add_canonical(0, make_cloud(14, 17), choose_some_codes)
    for frame, choose_code in enumerate((choose_varied_codes, choose_no_code, choose_some_codes)):
        symbols, births = make_moving_symbols(6, frame), make_births([1, 2, 5, 9], frame)
        stream.add_frame(Change(symbols, births, choose_code=choose_code))
    return stream


def make_counts_reset_by_canonical() -> Stream:
    """A canonical frame resets counts, motion and anchors."""
    symbols = make_moving_symbols(6, 3)
    stream = Stream(Head(level_count=2)).add_canonical(0, make_cloud(14, 14))
    stream.add_frame(Change(symbols, make_births([1, 2], 1))).add_frame(Change(symbols))
    stream.add_canonical(3, make_cloud(14, 15)).add_frame(Change(symbols, make_births([1, 2], 2)))
    return stream.add_frame(Change(symbols))


def make_zero_words() -> Stream:
    """A valid section begins with zero words."""
    opacities = [16384] * 8 + [16385]
    scene = [
        CodedGaussian((i, 0, 0), codes=(-40, -40, -40, v, 0, 0, 0)) for i, v in enumerate(opacities)
    ]
    return Stream(Head(sh_degree=0)).add_canonical(0, scene)


def make_reversing_motion() -> Stream:
    """The motion reverses in every frame and differs between the anchor levels."""
    stream = Stream(Head(level_count=3, gaussians_per_anchor=1)).add_canonical(
        0, make_cloud(12, 16)
    )
    for frame in range(1, 6):
        sign = (-1) ** frame
        change = Change(lambda level, anchor, s=sign: [s * (2 * level - 5) * (anchor % 4)] * 6)
        stream.add_frame(change)
    return stream


def make_repeated_greatest_motion() -> Stream:
    """The motion of a Gaussian has magnitude 195 in two frames, which is beyond 8 bits."""
    head = Head(level_count=3, gaussians_per_anchor=1, resample_interval=9)
    stream = Stream(head).add_canonical(0, make_cloud(12, 19))
    for sign in (1, 1, -1, -1):
        stream.add_frame(Change(lambda _level, _anchor, s=sign: [s * 65, 0, -s * 65, 0, 0, 0]))
    return stream
