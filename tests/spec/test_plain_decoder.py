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

    plain = [frame.state.digest() for frame in decode_plain(spec_text.read_spec(), data).frames]

    assert plain == [compute_digest(scene) for scene in decode(data)]
    assert plain == [compute_digest(state.scene) for state in states]


def test_a_parent_that_cancels_its_own_parent_counts_as_moving():
    """The sum is 0, but the parent's symbols are not: P is 1 and E is 0."""
    still = LevelContext(np.zeros(1, dtype=np.int64), np.zeros((6, 1), dtype=np.int64))
    levels = [PlainLevel([0], [[0, 0, 0]], [0], {}) for _ in range(3)]
    counts, plain_counts = ContextCounts(), {}
    for values in ((0, 0, 0), (2, 1, -1)):
        symbols = [np.array([[value], *[[0]] * 5]) for value in values]
        written = write_motion([still] * 3, symbols, counts)
        _, counts = read_motion(written, [still] * 3, counts)
        section = PlainSection("motion", written.words.tolist(), plain_counts)
        motion.read_motion(section, 6, {}, levels)
        section.close()
        assert [level.symbols for level in levels] == [[s[:, 0].tolist()] for s in symbols]
