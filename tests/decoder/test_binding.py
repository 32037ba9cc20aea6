import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from plain import oracle
from quarc_ref.decoder.binding import bind, bind_exhaustively
from quarc_ref.format.constants import POSITION_LIMIT

_AXES = st.sampled_from(
    [
        st.integers(-2, 2),
        st.integers(-500, 500),
        st.sampled_from([-POSITION_LIMIT, 0, POSITION_LIMIT]),
        st.integers(-POSITION_LIMIT, POSITION_LIMIT),
    ]
)
_CLOUD = _AXES.flatmap(lambda axis: st.lists(st.tuples(axis, axis, axis), min_size=1, max_size=30))


def _array(points):
    return np.array(points, dtype=np.int32).T


@given(_CLOUD, _CLOUD, st.integers(0, 24))
def test_any_cells_give_the_exhaustive_result(points, anchors, shift):
    expected = oracle.bind(points, anchors)

    assert bind(_array(points), _array(anchors), shift).tolist() == expected
    assert bind_exhaustively(_array(points), _array(anchors)).tolist() == expected


def test_of_equally_near_anchors_the_first_is_taken():
    anchors = _array([(4, 0, 0), (-4, 0, 0), (0, 4, 0), (-4, 0, 0)])

    assert bind(_array([(0, 0, 0), (-4, 0, 0)]), anchors, 2).tolist() == [0, 1]


def test_anchors_at_the_same_position_cost_no_more_than_one():
    """If equal positions were not merged, this input would take minutes: N x A distances."""
    points = np.full((3, 1 << 16), 17, dtype=np.int32)
    points[0, ::2] = -POSITION_LIMIT

    nearest = bind(points, points, 0)

    assert nearest.tolist() == [0, 1] * (1 << 15)


def test_many_gaussians_are_bound_like_few():
    rng = np.random.default_rng(0)
    points = rng.integers(-5000, 5000, (3, 4000)).astype(np.int32)
    points[:, 2000:] //= 50
    anchors = points[:, ::7]

    assert bind(points, anchors, 9).tolist() == bind_exhaustively(points, anchors).tolist()
