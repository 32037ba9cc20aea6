import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding import ans
from quarc_ref.format.coding.entropy import make_bit_decoder, make_fastest_decoder, use_bit_decoder
from quarc_ref.format.constants import WEIGHT_TOTAL
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError, VerificationError
from quarc_ref.inspection import cross_check
from quarc_ref.inspection.cross_check import CrossChecker
from quarc_ref.streams import decode
from tests.small_streams import make_stream

_BITS = np.arange(60) % 3 == 0
_WORDS = np.array(ans.encode_bits([(_BITS, 1 << 22)]), dtype=np.uint32)


class _FaultyDecoder(ans.PythonBitDecoder):
    """A decoder that fails in one way."""

    fault = "bit"

    def take(self, count, weight):
        bits = super().take(count, weight).copy()
        if self.fault == "bit":
            bits[count // 2] ^= True
        return bits

    def finish(self):
        if self.fault == "finish":
            message = "words remain"
            raise UnconsumedWordsError(message)
        super().finish()


def _decode(cross_check_decoder):
    decoder = cross_check_decoder.make_decoder(_WORDS)
    bits = decoder.take(60, 1 << 22)
    decoder.finish()
    return bits


def test_both_decoders_return_the_bits_which_are_counted():
    cross_checking = CrossChecker()

    assert _decode(cross_checking).tolist() == _BITS.tolist()
    assert _decode(cross_checking).tolist() == _BITS.tolist()
    assert (cross_checking.section_count, cross_checking.bit_count) == (2, 120)


@pytest.mark.parametrize("fault", ["bit", "finish"])
def test_a_difference_of_the_decoders_is_an_internal_error(fault, monkeypatch):
    monkeypatch.setattr(cross_check, "PythonBitDecoder", _FaultyDecoder)
    monkeypatch.setattr(_FaultyDecoder, "fault", fault)

    with pytest.raises(VerificationError):
        _decode(CrossChecker())


@given(
    st.lists(st.integers(0, (1 << 32) - 1), max_size=5),
    st.lists(st.tuples(st.integers(0, 40), st.integers(1, WEIGHT_TOTAL - 1)), max_size=4),
)
def test_random_words_are_decoded_or_rejected_by_both(words, runs):
    words = np.array(words, dtype=np.uint32)

    def decode_or_reject(make_decoder):
        try:
            decoder = make_decoder(words)
            bits = [decoder.take(*run).tolist() for run in runs]
            decoder.finish()
        except (InvalidWordsError, UnconsumedWordsError) as error:
            return error.reject_id
        return bits

    assert (
        decode_or_reject(CrossChecker().make_decoder)
        == decode_or_reject(make_fastest_decoder)
        == decode_or_reject(ans.PythonBitDecoder)
    )


def test_the_second_decoder_is_used_only_within_its_context():
    default_type = type(make_bit_decoder(_WORDS))
    with use_bit_decoder(ans.PythonBitDecoder):
        assert type(make_bit_decoder(_WORDS)) is ans.PythonBitDecoder
        with use_bit_decoder(CrossChecker().make_decoder):
            assert type(make_bit_decoder(_WORDS)).__name__ == "_CrossCheckingBitDecoder"
        assert type(make_bit_decoder(_WORDS)) is ans.PythonBitDecoder
    assert type(make_bit_decoder(_WORDS)) is default_type


def test_the_test_streams_decode_the_same_with_both(both_entropy_decoders):
    section_count = both_entropy_decoders.section_count
    data, states = make_stream.__wrapped__()  # made anew, because the closed loop decodes it
    list(decode(data))

    assert both_entropy_decoders.section_count >= section_count + 6 + 2 * (len(states) - 1)
