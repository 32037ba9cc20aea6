"""traps/: births, deaths, rotations and contexts."""

from making.frames import Change, Coded
from making.payloads import Head
from making.scenes import cloud, moving, newborn
from making.streams import Stream
from making.trap_making import telling, trap
from making.vectors import Valid


def make_lives() -> list[Valid]:
    """Return traps of births and deaths."""
    alike = [Coded((i, 3 * i % 7, 0), codes=(-40, -40, -40, 5, i, 0, 0)) for i in range(10)]
    equal = Stream(Head(sh_degree=0)).canonical(0, alike).frame(Change(deaths=3))
    equal.frame(
        Change(births=tuple(Coded((0, 1, k), codes=alike[0].codes, parent=2) for k in (0, 1)))
    )
    equal.frame(Change(deaths=7))
    signed = (-1, 1, -300, 32767, -32767, 0, 255, -256)
    signs = [Coded((i, 0, 0), codes=(-40, -40, -40, v, i, 0, 0)) for i, v in enumerate(signed)]
    below = Stream(Head(sh_degree=0)).canonical(0, signs)
    for deaths in (1, 2, 1, 2):
        below.frame(Change(deaths=deaths))
    faint = Coded((2, 0, 0), codes=(-40, -40, -40, -99, 1, 2, 3), parent=1)
    bright = Coded((1, 1, 0), codes=(-40, -40, -40, 99, 1, 2, 3), parent=1)
    unborn = Stream(Head(sh_degree=0, resample_interval=3)).canonical(0, alike)
    unborn.frame(Change(telling(6), (faint, bright)))
    unborn.frame(Change(telling(6), (faint, faint), deaths=1)).frame(Change(moving(6, 2), deaths=2))
    unborn.frame(Change(moving(6, 3), (faint,))).frame(Change(telling(6), deaths=1))
    unborn.frame(Change(telling(6), (bright,), deaths=1))
    bound = Stream(Head(sh_degree=0, resample_interval=9, gaussians_per_anchor=1)).canonical(
        0, alike
    )
    away = [40, 0, 0, 0, 0, 0]
    bound.frame(Change(lambda level, _: away if level == 3 else None, newborn([0, 4, 9], 2, 0)))
    bound.frame(Change(lambda level, _: away if level == 3 else None)).frame(Change(telling(6)))
    carried = Stream(Head(sh_degree=0, level_count=1, gaussians_per_anchor=1)).canonical(0, alike)
    carried.frame(Change(telling(6), newborn([0, 3, 5], 3, 0), deaths=4))
    carried.frame(Change(telling(6), newborn([1, 1, 6], 4, 0), deaths=2))
    twins = (
        Stream(Head(sh_degree=0)).canonical(0, alike).frame(Change(births=(faint, faint, faint)))
    )
    twins.frame(Change(telling(6))).frame(Change(telling(6), deaths=2))
    orphans = Stream(Head(sh_degree=0, resample_interval=9)).canonical(0, cloud(12, 8, 0))
    orphans.frame(Change(telling(6))).frame(Change(telling(6), deaths=6))
    orphans.frame(Change(telling(6))).frame(Change(telling(6), deaths=3)).frame(Change(telling(6)))
    fresh = Stream(Head(sh_degree=0)).canonical(0, alike).frame(Change(births=(faint, faint)))
    fresh.frame(Change(deaths=2)).frame(Change(births=(bright,))).frame(Change(telling(6)))
    return [
        trap(
            "equal-opacities",
            "7.4-3",
            equal,
            "of equal opacity codes the lowest ids die, old Gaussians before newborn",
        ),
        trap("signed-opacities", "7.4-3", below, "opacity codes are compared as signed integers"),
        trap(
            "deaths-of-newborn",
            "7.4 6.5 7.4-3",
            unborn,
            "newborn die in the frame after, unbound, with and without a sampling",
        ),
        trap(
            "newborn-bound-where-born",
            "6.5",
            bound,
            "newborn follow anchors where these were sampled, by positions before the motion",
        ),
        trap(
            "parents-after-deaths-and-motion",
            "7.6-1",
            carried,
            "parents are counted after the deaths, and stand where this frame has moved them",
        ),
        trap("twins", "7.6-1", twins, "equal newborn of one parent"),
        trap(
            "anchors-without-gaussian",
            "6.5 8.7",
            orphans,
            "anchors whose Gaussians have died still move others, and have no own motion",
        ),
        trap(
            "ids-are-not-given-again",
            "7.6-5",
            fresh,
            "the last born die, and the next newborn gets a later id",
        ),
    ]


def make_rotations() -> list[Valid]:
    """Return traps of rotations."""
    cloudy = cloud(16, 9, 0)
    one = {"sh_degree": 0, "level_count": 1, "rotation_unity": 1, "gaussians_per_anchor": 1}
    flip = Stream(Head(rotation_components=4, **one)).canonical(0, cloudy)  # type: ignore[arg-type]
    for w in (-3, -2, -1, 2):
        flip.frame(Change(lambda _level, anchor, w=w: [0, 0, 0, w, 0, anchor % 3, 1]))
    cancel = Stream(Head(sh_degree=0, level_count=2, gaussians_per_anchor=1, anchor_ratio=65535))
    cancel.canonical(0, cloudy)
    turn = [0, 0, 0, 5, -4, 3]
    back = [-v for v in turn]
    for _ in range(3):
        cancel.frame(
            Change(lambda level, anchor: turn if level == 2 else back if anchor % 2 else None)
        )
    alone = Stream(Head(rotation_components=4, sh_degree=0, rotation_unity=3)).canonical(0, cloudy)
    for w in (1, -2, 3, -4):
        alone.frame(Change(lambda _level, anchor, w=w: [0, 0, 0, w * (anchor % 2), 0, 0, 0]))
    halves = Stream(Head(**one, rotation_bits=14)).canonical(0, _odd())  # type: ignore[arg-type]
    for signs in ((1, 1, 1), (-1, 1, 1), (1, -1, -1), (-1, -1, -1)):
        halves.frame(Change(lambda _level, _anchor, s=signs: [0, 0, 0, *s]))
    return [
        trap(
            "signs-of-quaternions",
            "7.5 7.3-1",
            flip,
            "sums with a negative w: signs of rotations are kept as they come",
        ),
        trap(
            "sums-of-zero",
            "7.5",
            cancel,
            "symbols of two levels that cancel: the rotation stays as it is",
        ),
        trap("w-alone", "7.5", alone, "a residual of w alone goes through the formula too"),
        trap(
            "halves", "4.2 7.5", halves, "components of q x d that are halves: rounded away from 0"
        ),
    ]


def _odd() -> list[Coded]:
    """Rotations whose first component is odd about as often as even."""
    drawn = cloud(24, 10, 0)
    return [
        Coded(g.position, (i % 4, *(64 * c + i for c in g.rotation[1:])), g.codes)
        for i, g in enumerate(drawn)
    ]


def make_contexts() -> list[Valid]:
    """Return traps of contexts and counts."""
    head = Head(level_count=2)
    many = Stream(Head(level_count=1)).canonical(0, cloud(4, 11))
    for frame in range(2):
        many.frame(Change(moving(6, frame), newborn([k % 4 for k in range(470)], frame)))
    idle = Stream(head).canonical(0, cloud(20, 12))
    zeros = [0] * 6
    idle.frame(Change(lambda _level, anchor: zeros if anchor % 3 else None))
    idle.frame(Change(lambda _level, anchor: zeros if anchor % 2 else [1, *zeros[1:]]))
    still = Stream(head).canonical(0, cloud(30, 13, reach=300))
    for _ in range(5):
        still.frame()
    still.frame(Change(moving(6, 1))).frame().frame(Change(moving(6, 2)))
    again = Stream(head).canonical(0, cloud(14, 14))
    again.frame(Change(moving(6, 3), newborn([1, 2], 1), previous=1)).frame(Change(moving(6, 3)))
    again.canonical(3, cloud(14, 15)).frame(Change(moving(6, 3), newborn([1, 2], 2), previous=1))
    again.frame(Change(moving(6, 3)))
    code = (-40, -40, -40, 16384, 0, 0, 0)
    gaps = [Coded((i, 0, 0), codes=(*code[:3], 16384 + (i == 8), *code[4:])) for i in range(9)]
    opposed = Stream(Head(level_count=3, gaussians_per_anchor=1)).canonical(0, cloud(12, 16))
    for frame in range(1, 6):
        opposed.frame(
            Change(lambda level, anchor, f=frame: [(-1) ** f * (2 * level - 5) * (anchor % 4)] * 6)
        )
    return [
        trap("counts-are-halved", "8.2", many, "a context that meets more than 4096 bits"),
        trap(
            "moving-without-symbols",
            "8.7",
            idle,
            "anchors that are said to move and have symbols of 0 alone",
        ),
        trap(
            "stillness-is-counted",
            "8.2 8.7",
            still,
            "sections without words, whose planes are counted all the same",
        ),
        trap(
            "canonical-forgets",
            "7.2 8.2",
            again,
            "a canonical frame forgets counts, motion and anchors",
        ),
        trap(
            "words-of-zero",
            "8.3-1",
            Stream(Head(sh_degree=0)).canonical(0, gaps),
            "a section whose first words are 0",
        ),
        trap(
            "against-expectation",
            "8.7",
            opposed,
            "motion that turns around in every frame and differs between the levels",
        ),
    ]
