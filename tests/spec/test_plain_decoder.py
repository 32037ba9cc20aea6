"""The second decoder, written from SPEC.md, and the package find the same states."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from plain import motion, spec_text
from plain.decoder import decode_plain
from plain.planes import PlainSection
from plain.state import PlainLevel
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.motion_planes import LevelContext, read_motion, write_motion
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams import decode
from tests.small_streams import make_stream
from tests.strategies import headers


@settings(max_examples=12)
@given(headers(), st.integers(1, 14))
def test_both_decoders_give_the_same_states(header: StreamHeader, count: int):
    data, states = make_stream(header, gaussian_count=count, frame_count=5)

    plain_digests = [
        frame.state.compute_digest() for frame in decode_plain(spec_text.read_spec(), data).frames
    ]

    assert plain_digests == [compute_digest(scene) for scene in decode(data)]
    assert plain_digests == [compute_digest(state.scene) for state in states]


def test_a_parent_that_cancels_its_own_parent_counts_as_moving():
    """The parent's symbols are nonzero, although the sum of the levels is 0: P is 1, E is 0."""
    static_context = LevelContext(np.zeros(1, dtype=np.int64), np.zeros((6, 1), dtype=np.int64))
    levels = [PlainLevel([0], [[0, 0, 0]], [0], {}) for _ in range(3)]
    counts, plain_counts = ContextCounts(), {}
    for values in ((0, 0, 0), (2, 1, -1)):
        symbols = [np.array([[value], *[[0]] * 5]) for value in values]
        coded = write_motion([static_context] * 3, symbols, counts)
        _, counts = read_motion(coded, [static_context] * 3, counts)
        section = PlainSection("motion", coded.words.tolist(), plain_counts)
        motion.read_motion(section, 6, {}, levels)
        section.close()
        assert [level.symbols for level in levels] == [[s[:, 0].tolist()] for s in symbols]
