"""The second decoder, written from SPEC.md's words, and the package come to the same states."""

from hypothesis import given, settings
from hypothesis import strategies as st

from quarc_ref.decoder import decode
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.format.records import StreamHeader
from tests.spec import spec_text
from tests.spec.plain_decoder import decode_plain
from tests.strategies import headers
from tests.streams import make_stream


@settings(max_examples=12)
@given(headers(), st.integers(1, 14))
def test_both_decoders_find_the_same_states(header: StreamHeader, count: int):
    data, states = make_stream(header, gaussian_count=count, frame_count=5)

    plain = [frame.state.digest() for frame in decode_plain(spec_text.text(), data).frames]

    assert plain == [compute_digest(scene) for scene in decode(data)]
    assert plain == [compute_digest(state.scene) for state in states]
