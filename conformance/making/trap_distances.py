"""Makes vectors in traps/ for lattice edges and nearly equal distances (SPEC 6.4, 7.2)."""

from collections.abc import Sequence
from itertools import product

from making.changes import Change, CodedGaussian
from making.payloads import Head
from making.planes import compute_morton_key
from making.scenes import select_symbols
from making.streams import Stream
from making.trap_making import make_trap_streams
from making.vectors import ValidStream
from plain import oracle

Position = tuple[int, int, int]
_POSITION_STEP, _EDGE_IN_STEPS = 47, 178481  # their product is POSITION_LIMIT


def make_distance_traps() -> list[ValidStream]:
    """Return the traps for distances."""
    return make_trap_streams(
        (
            ("lattice-extremes", make_lattice_corners, "6.3 6.4 7.2-3"),
            ("lattice-edge-newborn", make_birth_at_lattice_edge, "7.6-2"),
            ("nearly-equal-distances", make_nearly_equal_distances, "4.1-1 6.4"),
        )
    )


def _make_corners() -> list[CodedGaussian]:
    return [
        CodedGaussian(position) for position in product((-_EDGE_IN_STEPS, _EDGE_IN_STEPS), repeat=3)
    ]


def make_lattice_corners() -> Stream:
    """At the corners of the lattice, Gaussians are as far apart as possible."""
    stream = Stream(Head(sh_degree=0, position_step=_POSITION_STEP, gaussians_per_anchor=4))
    stream.add_canonical(
        0,
        [
            *_make_corners(),
            CodedGaussian((0, 0, 0)),
            CodedGaussian((_EDGE_IN_STEPS, 0, -_EDGE_IN_STEPS)),
        ],
    )
    return stream.add_frame(
        Change(select_symbols((1, 0, [0, 0, 0, 1, 2, 3]), (2, 0, [0, 0, 0, 3, 2, 1])))
    )


def make_birth_at_lattice_edge() -> Stream:
    """A Gaussian is born next to a Gaussian at the edge of the lattice."""
    head = Head(
        sh_degree=0, position_step=_POSITION_STEP, translation_step=_POSITION_STEP, level_count=1
    )
    return (
        Stream(head)
        .add_canonical(0, _make_corners())
        .add_frame(Change(births=(CodedGaussian((-3, 0, 0), parent=4),)))
    )


def make_nearly_equal_distances() -> Stream:
    """Squared distances above 2^46 differ by a few thousand; in binary32 they would be equal."""
    cluster_positions = [
        (-1, -y, -z) for y, z in ((9, 1), (7, 3), (8, 1), (5, 1), (4, 2), (6, 2), (9, 4))
    ]
    corner_positions = [
        position
        for position in product((-_EDGE_IN_STEPS, -1), repeat=3)
        if position[1:] != (-1, -1)
    ]
    positions = [(-_EDGE_IN_STEPS, -1, -1), *cluster_positions, *corner_positions]
    anchor_fields = {"gaussians_per_anchor": 2, "level_count": 1}
    head = Head(
        sh_degree=0, position_step=_POSITION_STEP, seed=_find_seed(positions), **anchor_fields
    )
    change = Change(lambda _level, anchor: [0, 0, 0, anchor - 3, 1, anchor % 3])
    return (
        Stream(head)
        .add_canonical(0, map(CodedGaussian, positions))
        .add_frame(change)
        .add_frame(change)
    )


def _find_seed(positions: Sequence[Position]) -> int:
    """Return the lowest seed with which `positions[0]` follows the last anchor of the cluster."""
    origin = [min(position[axis] for position in positions) for axis in range(3)]
    sorted_positions = sorted(positions, key=lambda position: compute_morton_key(position, origin))
    lattice_positions = [
        tuple(_POSITION_STEP * coordinate for coordinate in position)
        for position in sorted_positions
    ]
    far_index = sorted_positions.index(positions[0])
    for seed in range(1 << 20):
        anchors = oracle.sample(
            list(range(len(lattice_positions))),
            lattice_positions,
            1,
            seed,
            1,
            len(lattice_positions) // 2,
        )
        nearest_index = oracle.bind(
            [lattice_positions[far_index]], [lattice_positions[i] for i in anchors]
        )[0]
        cluster_anchors = [
            i for i in anchors if sorted_positions[i][0] == -1 > sorted_positions[i][1] > -10
        ]
        if (
            far_index not in anchors
            and len(cluster_anchors) > 2
            and anchors[nearest_index] == cluster_anchors[-1]
        ):
            return seed
    raise AssertionError
