"""traps/: births and deaths (SPEC 6.5, 7.4, 7.6)."""

from making.changes import Change, Coded
from making.payloads import Head
from making.scenes import cloud, moving, newborn
from making.streams import Stream
from making.trap_making import distinct_motion, distinct_symbols, make_trap_vectors
from making.vectors import Valid

_ALIKE = [Coded((i, 3 * i % 7, 0), codes=(-40, -40, -40, 5, i, 0, 0)) for i in range(10)]
_FAINT = Coded((2, 0, 0), codes=(-40, -40, -40, -99, 1, 2, 3), parent=1)
_BRIGHT = Coded((1, 1, 0), codes=(-40, -40, -40, 99, 1, 2, 3), parent=1)


def make_life_traps() -> list[Valid]:
    """Return all vectors."""
    return make_trap_vectors(
        (
            (equal_opacities, "7.4-3"),
            (signed_opacities, "7.4-3"),
            (deaths_of_newborn, "7.4 6.5 7.4-3"),
            (newborn_bound_where_born, "6.5"),
            (parents_after_deaths_and_motion, "7.6-1"),
            (twins, "7.6-1"),
            (anchors_without_gaussian, "6.5 8.7"),
            (ids_are_not_given_again, "7.6-5"),
        )
    )


def equal_opacities() -> Stream:
    """Of Gaussians with equal opacity codes the lowest ids die, old ones before births."""
    stream = Stream(Head(sh_degree=0)).canonical(0, _ALIKE).frame(Change(deaths=3))
    born = tuple(Coded((0, 1, k), codes=_ALIKE[0].codes, parent=2) for k in (0, 1))
    return stream.frame(Change(births=born)).frame(Change(deaths=7))


def signed_opacities() -> Stream:
    """Opacity codes are compared as signed integers."""
    opacities = enumerate((-1, 1, -300, 32767, -32767, 0, 255, -256))
    signs = [Coded((i, 0, 0), codes=(-40, -40, -40, v, i, 0, 0)) for i, v in opacities]
    stream = Stream(Head(sh_degree=0)).canonical(0, signs)
    for deaths in (1, 2, 1, 2):
        stream.frame(Change(deaths=deaths))
    return stream


def deaths_of_newborn() -> Stream:
    """Births die in the next frame before they are bound, with and without a sampling."""
    told = distinct_symbols()
    stream = Stream(Head(sh_degree=0, resample_interval=3)).canonical(0, _ALIKE)
    stream.frame(Change(told, (_FAINT, _BRIGHT))).frame(Change(told, (_FAINT, _FAINT), deaths=1))
    stream.frame(Change(moving(6, 2), deaths=2)).frame(Change(moving(6, 3), (_FAINT,)))
    return stream.frame(Change(told, deaths=1)).frame(Change(told, (_BRIGHT,), deaths=1))


def newborn_bound_where_born() -> Stream:
    """Births follow anchors at their sampled positions, by positions before the motion."""
    head = Head(sh_degree=0, resample_interval=9, gaussians_per_anchor=1)
    stream = Stream(head).canonical(0, _ALIKE)

    def far_motion(level: int, _anchor: int) -> list[int] | None:
        return [40, 0, 0, 0, 0, 0] if level == head.level_count else None

    stream.frame(Change(far_motion, newborn([0, 4, 9], 2, 0)))
    return stream.frame(Change(far_motion)).frame(distinct_motion())


def parents_after_deaths_and_motion() -> Stream:
    """Parents are counted after the deaths, at their positions after the motion of this frame."""
    stream = Stream(Head(sh_degree=0, level_count=1, gaussians_per_anchor=1))
    stream.canonical(0, _ALIKE).frame(
        Change(distinct_symbols(), newborn([0, 3, 5], 3, 0), deaths=4)
    )
    return stream.frame(Change(distinct_symbols(), newborn([1, 1, 6], 4, 0), deaths=2))


def twins() -> Stream:
    """Equal births of one parent."""
    stream = Stream(Head(sh_degree=0)).canonical(0, _ALIKE)
    stream.frame(Change(births=(_FAINT, _FAINT, _FAINT))).frame(distinct_motion())
    return stream.frame(Change(distinct_symbols(), deaths=2))


def anchors_without_gaussian() -> Stream:
    """Anchors whose Gaussians have died still move others, and have no motion of their own."""
    stream = Stream(Head(sh_degree=0, resample_interval=9)).canonical(0, cloud(12, 8, 0))
    for deaths in (0, 6, 0, 3, 0):
        stream.frame(Change(distinct_symbols(), deaths=deaths))
    return stream


def ids_are_not_given_again() -> Stream:
    """The last births die, and the next newborn gets a later id."""
    stream = Stream(Head(sh_degree=0)).canonical(0, _ALIKE).frame(Change(births=(_FAINT, _FAINT)))
    return stream.frame(Change(deaths=2)).frame(Change(births=(_BRIGHT,))).frame(distinct_motion())
