"""traps/: the edges of the lattice, and distances that are nearly equal (SPEC 6.4, 7.2)."""

from collections.abc import Sequence
from itertools import product

from making.changes import Change, CodedGaussian
from making.payloads import Head
from making.planes import morton_key
from making.scenes import select_symbols
from making.streams import Stream
from making.trap_making import make_trap_streams
from making.vectors import ValidStream
from plain import oracle

Place = tuple[int, int, int]
_STEP, _EDGE = 47, 178481  # their product is POSITION_LIMIT


def make_distance_traps() -> list[ValidStream]:
    """Return all vectors."""
    return make_trap_streams(
        (
            (lattice_extremes, "6.3 6.4 7.2-3"),
            (lattice_edge_newborn, "7.6-2"),
            (nearly_equal_distances, "4.1-1 6.4"),
        )
    )


def _corners() -> list[CodedGaussian]:
    return [CodedGaussian(place) for place in product((-_EDGE, _EDGE), repeat=3)]


def lattice_extremes() -> Stream:
    """Gaussians at the corners of the lattice, with the greatest distances."""
    stream = Stream(Head(sh_degree=0, position_step=_STEP, gaussians_per_anchor=4))
    stream.add_canonical(
        0, [*_corners(), CodedGaussian((0, 0, 0)), CodedGaussian((_EDGE, 0, -_EDGE))]
    )
    return stream.add_frame(
        Change(select_symbols((1, 0, [0, 0, 0, 1, 2, 3]), (2, 0, [0, 0, 0, 3, 2, 1])))
    )


def lattice_edge_newborn() -> Stream:
    """A newborn next to a Gaussian at the edge."""
    head = Head(sh_degree=0, position_step=_STEP, translation_step=_STEP, level_count=1)
    return (
        Stream(head)
        .add_canonical(0, _corners())
        .add_frame(Change(births=(CodedGaussian((-3, 0, 0), parent=4),)))
    )


def nearly_equal_distances() -> Stream:
    """Squared distances beyond 2^46 that differ by a few thousand: a tie in binary32."""
    cluster = [(-1, -y, -z) for y, z in ((9, 1), (7, 3), (8, 1), (5, 1), (4, 2), (6, 2), (9, 4))]
    around = [place for place in product((-_EDGE, -1), repeat=3) if place[1:] != (-1, -1)]
    places = [(-_EDGE, -1, -1), *cluster, *around]
    anchor_fields = {"gaussians_per_anchor": 2, "level_count": 1}
    head = Head(sh_degree=0, position_step=_STEP, seed=_find_seed(places), **anchor_fields)
    change = Change(lambda _level, anchor: [0, 0, 0, anchor - 3, 1, anchor % 3])
    return (
        Stream(head)
        .add_canonical(0, map(CodedGaussian, places))
        .add_frame(change)
        .add_frame(change)
    )


def _find_seed(places: Sequence[Place]) -> int:
    """Return the lowest seed for which the first place follows the last anchor of the cluster."""
    origin = [min(place[axis] for place in places) for axis in range(3)]
    sorted_places = sorted(places, key=lambda place: morton_key(place, origin))
    lattice = [tuple(_STEP * v for v in place) for place in sorted_places]
    far_index = sorted_places.index(places[0])
    for seed in range(1 << 20):
        anchors = oracle.sample(list(range(len(lattice))), lattice, 1, seed, 1, len(lattice) // 2)
        nearest = oracle.bind([lattice[far_index]], [lattice[i] for i in anchors])[0]
        cluster_anchors = [
            i for i in anchors if sorted_places[i][0] == -1 > sorted_places[i][1] > -10
        ]
        if (
            far_index not in anchors
            and len(cluster_anchors) > 2
            and anchors[nearest] == cluster_anchors[-1]
        ):
            return seed
    raise AssertionError
