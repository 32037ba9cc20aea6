"""Makes vectors in traps/ for the number and the choice of anchors (SPEC 6.1 to 6.3)."""

from itertools import product

from making.changes import Change, CodedGaussian
from making.payloads import Head
from making.scenes import make_births, make_cloud, make_moving_symbols
from making.streams import Stream
from making.trap_making import make_distinct_motion, make_trap_streams
from making.vectors import ValidStream

_TIED_SEED = 5546942  # found by search: at phase 1, ids 1 and 56 have the same random word


def make_anchor_traps() -> list[ValidStream]:
    """Return the traps for anchors."""
    return make_trap_streams(
        (
            ("one-place", make_one_position, "6.3 6.4"),
            ("equally-near", make_equally_near_anchors, "6.4"),
            ("one-gaussian", make_one_gaussian, "6.1"),
            ("one-anchor", make_one_anchor, "6.1"),
            ("every-gaussian-an-anchor", make_every_gaussian_an_anchor, "6.1 6.3"),
            ("sampled-at-the-end", make_sampling_in_last_frame, "6.5 7.4"),
            ("phase-not-ordinal", make_ranks_by_phase, "6.2"),
            ("equal-ranks", make_equal_ranks, "6.2 6.3"),
        )
    )


def make_one_position() -> Stream:
    """All Gaussians are at one position, so all distances are 0; anchors follow other anchors."""
    stream = Stream(Head(sh_degree=0)).add_canonical(0, [CodedGaussian((7, 7, 7))] * 11)
    return stream.add_frame(make_distinct_motion()).add_frame(Change(make_moving_symbols(6, 1)))


def make_equally_near_anchors() -> Stream:
    """On a grid around the origin, several anchors are equally near; positions have both signs."""
    grid = [CodedGaussian(position) for position in product((-1, 0, 1), repeat=3)]
    stream = Stream(Head(sh_degree=0, gaussians_per_anchor=3)).add_canonical(0, grid)
    stream.add_frame(make_distinct_motion()).add_frame(
        Change(make_moving_symbols(6, 5), make_births([0, 13, 26], 1, 0))
    )
    return stream.add_frame(make_distinct_motion()).add_frame(make_distinct_motion())


def make_one_gaussian() -> Stream:
    """With one Gaussian, every level has one anchor; then a Gaussian is born next to it."""
    stream = (
        Stream(Head(sh_degree=0))
        .add_canonical(0, [CodedGaussian((1, 2, 3))])
        .add_frame(make_distinct_motion())
    )
    return stream.add_frame(Change(births=make_births([0], 3, 0))).add_frame(make_distinct_motion())


def make_one_anchor() -> Stream:
    """gaussians_per_anchor exceeds the number of Gaussians, so every level has one anchor."""
    stream = Stream(Head(sh_degree=0, gaussians_per_anchor=65535))
    return (
        stream.add_canonical(0, make_cloud(5, 3, 0))
        .add_frame(make_distinct_motion())
        .add_frame(make_distinct_motion())
    )


def make_every_gaussian_an_anchor() -> Stream:
    """Every Gaussian is an anchor of level 1, and some share a position; level 2 has one anchor."""
    stream = Stream(Head(sh_degree=0, gaussians_per_anchor=1, anchor_ratio=65535))
    stream.add_canonical(0, [*make_cloud(7, 4, 0), *make_cloud(3, 4, 0)])
    return stream.add_frame(make_distinct_motion()).add_frame(make_distinct_motion())


def make_sampling_in_last_frame() -> Stream:
    """The last frame samples anchors from Gaussians that include births of the previous frame."""
    stream = Stream(Head(resample_interval=4, sh_degree=0)).add_canonical(0, make_cloud(9, 5, 0))
    for frame in range(1, 5):
        stream.add_frame(
            Change(make_moving_symbols(6, frame), make_births([2], frame, 0) if frame > 2 else ())
        )
    return stream.add_frame(make_distinct_motion())


def make_ranks_by_phase() -> Stream:
    """Random ranks depend on the phase, which a canonical frame resets, and not on the ordinal."""
    stream = (
        Stream(Head(sh_degree=0))
        .add_canonical(1000, make_cloud(13, 6, 0, limit=300))
        .add_frame(make_distinct_motion())
    )
    return stream.add_canonical(1002, make_cloud(13, 7, 0, limit=300)).add_frame(
        make_distinct_motion()
    )


def make_equal_ranks() -> Stream:
    """Two Gaussians have the same random word, and only the one with the lower id is an anchor."""
    stream = Stream(Head(sh_degree=0, seed=_TIED_SEED, gaussians_per_anchor=8))
    # Each of the four positions gets an anchor; then only one of the two ids is still needed.
    stream.add_canonical(0, [CodedGaussian((40 * (i // 16), 0, 0)) for i in range(57)])
    return stream.add_frame(make_distinct_motion()).add_frame(make_distinct_motion())
