"""traps/: the number of anchors, and which Gaussians they are (SPEC 6.1 to 6.3)."""

from itertools import product

from making.changes import Change, Coded
from making.payloads import Head
from making.scenes import cloud, moving, newborn
from making.streams import Stream
from making.trap_making import distinct_motion, make_trap_vectors
from making.vectors import Valid

_TIED_SEED = 5546942  # found by search: at phase 1 the ids 1 and 56 draw one word


def make_anchor_traps() -> list[Valid]:
    """Return all vectors."""
    return make_trap_vectors(
        (
            (one_place, "6.3 6.4"),
            (equally_near, "6.4"),
            (one_gaussian, "6.1"),
            (one_anchor, "6.1"),
            (every_gaussian_an_anchor, "6.1 6.3"),
            (sampled_at_the_end, "6.5 7.4"),
            (phase_not_ordinal, "6.2"),
            (equal_ranks, "6.2 6.3"),
        )
    )


def one_place() -> Stream:
    """All Gaussians at one position: every distance is a tie, and anchors follow others."""
    stream = Stream(Head(sh_degree=0)).canonical(0, [Coded((7, 7, 7))] * 11)
    return stream.frame(distinct_motion()).frame(Change(moving(6, 1)))


def equally_near() -> Stream:
    """A grid around the origin: many anchors are equally near, and cells are on both sides of 0."""
    grid = [Coded(place) for place in product((-1, 0, 1), repeat=3)]
    stream = Stream(Head(sh_degree=0, gaussians_per_anchor=3)).canonical(0, grid)
    stream.frame(distinct_motion()).frame(Change(moving(6, 5), newborn([0, 13, 26], 1, 0)))
    return stream.frame(distinct_motion()).frame(distinct_motion())


def one_gaussian() -> Stream:
    """One Gaussian: A_l is 1 at every level; then a newborn next to it."""
    stream = Stream(Head(sh_degree=0)).canonical(0, [Coded((1, 2, 3))]).frame(distinct_motion())
    return stream.frame(Change(births=newborn([0], 3, 0))).frame(distinct_motion())


def one_anchor() -> Stream:
    """More Gaussians per anchor than there are Gaussians."""
    stream = Stream(Head(sh_degree=0, gaussians_per_anchor=65535))
    return stream.canonical(0, cloud(5, 3, 0)).frame(distinct_motion()).frame(distinct_motion())


def every_gaussian_an_anchor() -> Stream:
    """M is 1 and some Gaussians share a position; A_2 is 1 because of the ratio."""
    stream = Stream(Head(sh_degree=0, gaussians_per_anchor=1, anchor_ratio=65535))
    stream.canonical(0, [*cloud(7, 4, 0), *cloud(3, 4, 0)])
    return stream.frame(distinct_motion()).frame(distinct_motion())


def sampled_at_the_end() -> Stream:
    """Anchors are sampled in the last frame, some of them births of the previous frame."""
    stream = Stream(Head(resample_interval=4, sh_degree=0)).canonical(0, cloud(9, 5, 0))
    for frame in range(1, 5):
        stream.frame(Change(moving(6, frame), newborn([2], frame, 0) if frame > 2 else ()))
    return stream.frame(distinct_motion())


def phase_not_ordinal() -> Stream:
    """Ranks are drawn by phase, which a canonical frame resets."""
    stream = (
        Stream(Head(sh_degree=0))
        .canonical(1000, cloud(13, 6, 0, reach=300))
        .frame(distinct_motion())
    )
    return stream.canonical(1002, cloud(13, 7, 0, reach=300)).frame(distinct_motion())


def equal_ranks() -> Stream:
    """Two Gaussians draw the same word and one anchor is missing: it is the one of lower id."""
    stream = Stream(Head(sh_degree=0, seed=_TIED_SEED, gaussians_per_anchor=8))
    # Four positions: after the anchors of their cells, only one of the two ids is needed.
    stream.canonical(0, [Coded((40 * (i // 16), 0, 0)) for i in range(57)])
    return stream.frame(distinct_motion()).frame(distinct_motion())
