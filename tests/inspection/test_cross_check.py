import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding import ans
from quarc_ref.format.coding.entropy import make_bit_decoder, make_fastest_decoder, use_bit_decoder
from quarc_ref.format.constants import WEIGHT_TOTAL
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError, VerificationError
from quarc_ref.inspection import cross_check
from quarc_ref.inspection.cross_check import CrossCheckingDecoder
from quarc_ref.streams import decode
from tests.small_streams import make_stream

_BITS = np.arange(60) % 3 == 0
_WORDS = np.array(ans.encode_bits([(_BITS, 1 << 22)]), dtype=np.uint32)


class _Wrong(ans.PythonBitDecoder):
    """A decoder with one fault."""

    fault = "bit"

    def take(self, count, weight):
        bits = super().take(count, weight).copy()
        if self.fault == "bit":
            bits[count // 2] ^= True
        return bits

    def finish(self):
        if self.fault == "finish":
            message = "left"
            raise UnconsumedWordsError(message)
        super().finish()


def _decode(coders):
    decoder = coders.open(_WORDS)
    bits = decoder.take(60, 1 << 22)
    decoder.finish()
    return bits


def test_both_decoders_return_the_bits_which_are_counted():
    coders = CrossCheckingDecoder()

    assert _decode(coders).tolist() == _BITS.tolist()
    assert _decode(coders).tolist() == _BITS.tolist()
    assert (coders.section_count, coders.bit_count) == (2, 120)


@pytest.mark.parametrize("fault", ["bit", "finish"])
def test_a_difference_of_the_decoders_is_an_internal_error(fault, monkeypatch):
    monkeypatch.setattr(cross_check, "PythonBitDecoder", _Wrong)
    monkeypatch.setattr(_Wrong, "fault", fault)

    with pytest.raises(VerificationError):
        _decode(CrossCheckingDecoder())


@given(
    st.lists(st.integers(0, (1 << 32) - 1), max_size=5),
    st.lists(st.tuples(st.integers(0, 40), st.integers(1, WEIGHT_TOTAL - 1)), max_size=4),
)
def test_random_words_are_decoded_or_rejected_by_both(words, runs):
    words = np.array(words, dtype=np.uint32)

    def outcome(opener):
        try:
            decoder = opener(words)
            bits = [decoder.take(*run).tolist() for run in runs]
            decoder.finish()
        except (InvalidWordsError, UnconsumedWordsError) as error:
            return error.reject_id
        return bits

    assert (
        outcome(CrossCheckingDecoder().open)
        == outcome(make_fastest_decoder)
        == outcome(ans.PythonBitDecoder)
    )


def test_the_second_decoder_is_used_only_within_its_context():
    before = type(make_bit_decoder(_WORDS))
    with use_bit_decoder(ans.PythonBitDecoder):
        assert type(make_bit_decoder(_WORDS)) is ans.PythonBitDecoder
        with use_bit_decoder(CrossCheckingDecoder().open):
            assert type(make_bit_decoder(_WORDS)).__name__ == "_CrossCheckingBitDecoder"
        assert type(make_bit_decoder(_WORDS)) is ans.PythonBitDecoder
    assert type(make_bit_decoder(_WORDS)) is before


def test_the_test_streams_decode_the_same_with_both(both_entropy_decoders):
    before = both_entropy_decoders.section_count
    data, states = make_stream()
    list(decode(data))

    assert both_entropy_decoders.section_count >= before + 6 + 2 * (len(states) - 1)
