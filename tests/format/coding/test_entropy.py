import importlib.util
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding import ans, entropy
from quarc_ref.format.constants import WEIGHT_TOTAL
from quarc_ref.format.errors import InvalidWordsError, UnconsumedWordsError

_RUNS = st.lists(
    st.tuples(
        st.lists(st.booleans(), max_size=40).map(lambda bits: np.array(bits, dtype=bool)),
        st.integers(1, WEIGHT_TOTAL - 1),
    ),
    max_size=8,
)
_DECODERS = [ans.PythonBitDecoder, entropy.make_bit_decoder]


@pytest.mark.skipif(not entropy.HAS_CONSTRICTION, reason="constriction has no wheel here")
@given(_RUNS)
def test_both_coders_write_the_same_words(runs):
    assert entropy.encode_bits(runs).tolist() == ans.encode_bits(runs)


@pytest.mark.parametrize("make_bit_decoder", _DECODERS)
@given(_RUNS)
def test_both_decoders_return_the_bits_and_end_empty(make_bit_decoder, runs):
    decoder = make_bit_decoder(entropy.encode_bits(runs))

    for bits, weight in runs:
        assert decoder.take(bits.size, weight).tolist() == bits.tolist()
    decoder.finish()


def test_a_small_message_has_the_expected_words():
    runs = [(np.array([1, 0, 0, 1, 1], dtype=bool), 1 << 20), (np.array([0, 1], dtype=bool), 256)]

    assert ans.encode_bits(runs) == [1458569216, 19]


@pytest.mark.parametrize("make_bit_decoder", _DECODERS)
def test_a_last_word_of_zero_is_rejected(make_bit_decoder):
    with pytest.raises(InvalidWordsError):
        make_bit_decoder(np.array([5, 0], dtype=np.uint32))


@pytest.mark.parametrize("make_bit_decoder", _DECODERS)
@pytest.mark.parametrize("words", [[7], [1, 2, 3], [0, 9]])
def test_remaining_words_are_rejected(make_bit_decoder, words):
    decoder = make_bit_decoder(np.array(words, dtype=np.uint32))
    decoder.take(1, 1 << 23)

    with pytest.raises(UnconsumedWordsError):
        decoder.finish()


def test_without_constriction_the_python_coder_decodes(monkeypatch):
    monkeypatch.setitem(sys.modules, "constriction", None)
    spec = importlib.util.spec_from_file_location("entropy_alone", entropy.__file__)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    bits = np.arange(50) % 3 == 0

    words = module.encode_bits([(bits, 1 << 22)])
    decoder = module.make_bit_decoder(words)

    assert not module.HAS_CONSTRICTION
    assert words.tolist() == ans.encode_bits([(bits, 1 << 22)])
    assert decoder.take(50, 1 << 22).tolist() == bits.tolist()
    decoder.finish()
