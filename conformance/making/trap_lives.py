"""Makes vectors in traps/ for births and deaths (SPEC 6.5, 7.4, 7.6)."""

from making.changes import Change, CodedGaussian
from making.payloads import Head
from making.scenes import make_births, make_cloud, make_moving_symbols
from making.streams import Stream
from making.trap_making import make_distinct_motion, make_distinct_symbols, make_trap_streams
from making.vectors import ValidStream

_EQUALLY_OPAQUE_SCENE = [
    CodedGaussian((i, 3 * i % 7, 0), codes=(-40, -40, -40, 5, i, 0, 0)) for i in range(10)
]
_FAINT_BIRTH = CodedGaussian((2, 0, 0), codes=(-40, -40, -40, -99, 1, 2, 3), parent=1)
_BRIGHT_BIRTH = CodedGaussian((1, 1, 0), codes=(-40, -40, -40, 99, 1, 2, 3), parent=1)


def make_birth_and_death_traps() -> list[ValidStream]:
    """Return the traps for births and deaths."""
    return make_trap_streams(
        (
            ("equal-opacities", make_equal_opacities, "7.4-3"),
            ("signed-opacities", make_signed_opacities, "7.4-3"),
            ("deaths-of-newborn", make_deaths_of_newborn, "7.4 6.5 7.4-3"),
            ("newborn-bound-where-born", make_newborn_bound_before_motion, "6.5"),
            ("parents-after-deaths-and-motion", make_parents_after_deaths_and_motion, "7.6-1"),
            ("twins", make_equal_births, "7.6-1"),
            ("anchors-without-gaussian", make_anchors_of_dead_gaussians, "6.5 8.7"),
            ("ids-are-not-given-again", make_ids_that_are_not_reused, "7.6-5"),
        )
    )


def make_equal_opacities() -> Stream:
    """Among Gaussians with equal opacity codes, those with the lowest ids die first."""
    stream = (
        Stream(Head(sh_degree=0))
        .add_canonical(0, _EQUALLY_OPAQUE_SCENE)
        .add_frame(Change(death_count=3))
    )
    births = tuple(
        CodedGaussian((0, 1, k), codes=_EQUALLY_OPAQUE_SCENE[0].codes, parent=2) for k in (0, 1)
    )
    return stream.add_frame(Change(births=births)).add_frame(Change(death_count=7))


def make_signed_opacities() -> Stream:
    """Opacity codes are compared as signed integers."""
    opacities = enumerate((-1, 1, -300, 32767, -32767, 0, 255, -256))
    gaussians = [CodedGaussian((i, 0, 0), codes=(-40, -40, -40, v, i, 0, 0)) for i, v in opacities]
    stream = Stream(Head(sh_degree=0)).add_canonical(0, gaussians)
    for deaths in (1, 2, 1, 2):
        stream.add_frame(Change(death_count=deaths))
    return stream


def make_deaths_of_newborn() -> Stream:
    """New Gaussians die in the next frame before binding, even if that frame samples anchors."""
    symbols = make_distinct_symbols()
    stream = Stream(Head(sh_degree=0, resample_interval=3)).add_canonical(0, _EQUALLY_OPAQUE_SCENE)
    stream.add_frame(Change(symbols, (_FAINT_BIRTH, _BRIGHT_BIRTH))).add_frame(
        Change(symbols, (_FAINT_BIRTH, _FAINT_BIRTH), death_count=1)
    )
    stream.add_frame(Change(make_moving_symbols(6, 2), death_count=2)).add_frame(
        Change(make_moving_symbols(6, 3), (_FAINT_BIRTH,))
    )
    return stream.add_frame(Change(symbols, death_count=1)).add_frame(
        Change(symbols, (_BRIGHT_BIRTH,), death_count=1)
    )


def make_newborn_bound_before_motion() -> Stream:
    """New Gaussians are bound by their positions before the motion, to the sampled anchors."""
    head = Head(sh_degree=0, resample_interval=9, gaussians_per_anchor=1)
    stream = Stream(head).add_canonical(0, _EQUALLY_OPAQUE_SCENE)

    def far_motion(level: int, _anchor: int) -> list[int] | None:
        return [40, 0, 0, 0, 0, 0] if level == head.level_count else None

    stream.add_frame(Change(far_motion, make_births([0, 4, 9], 2, 0)))
    return stream.add_frame(Change(far_motion)).add_frame(make_distinct_motion())


def make_parents_after_deaths_and_motion() -> Stream:
    """Parent indices are counted after the deaths; parent positions are those after the motion."""
    stream = Stream(Head(sh_degree=0, level_count=1, gaussians_per_anchor=1))
    stream.add_canonical(0, _EQUALLY_OPAQUE_SCENE).add_frame(
        Change(make_distinct_symbols(), make_births([0, 3, 5], 3, 0), death_count=4)
    )
    return stream.add_frame(
        Change(make_distinct_symbols(), make_births([1, 1, 6], 4, 0), death_count=2)
    )


def make_equal_births() -> Stream:
    """A parent has several equal births."""
    stream = Stream(Head(sh_degree=0)).add_canonical(0, _EQUALLY_OPAQUE_SCENE)
    stream.add_frame(Change(births=(_FAINT_BIRTH, _FAINT_BIRTH, _FAINT_BIRTH))).add_frame(
        make_distinct_motion()
    )
    return stream.add_frame(Change(make_distinct_symbols(), death_count=2))


def make_anchors_of_dead_gaussians() -> Stream:
    """An anchor whose Gaussian has died still moves its followers; its previous motion is 0."""
    stream = Stream(Head(sh_degree=0, resample_interval=9)).add_canonical(0, make_cloud(12, 8, 0))
    for deaths in (0, 6, 0, 3, 0):
        stream.add_frame(Change(make_distinct_symbols(), death_count=deaths))
    return stream


def make_ids_that_are_not_reused() -> Stream:
    """After the Gaussians with the highest ids die, the next birth does not reuse their ids."""
    stream = (
        Stream(Head(sh_degree=0))
        .add_canonical(0, _EQUALLY_OPAQUE_SCENE)
        .add_frame(Change(births=(_FAINT_BIRTH, _FAINT_BIRTH)))
    )
    return (
        stream.add_frame(Change(death_count=2))
        .add_frame(Change(births=(_BRIGHT_BIRTH,)))
        .add_frame(make_distinct_motion())
    )
