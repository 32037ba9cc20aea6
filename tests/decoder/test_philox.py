import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from plain import oracle
from quarc_ref.decoder.philox import philox

_WORD = st.integers(0, (1 << 32) - 1)


@pytest.mark.parametrize(
    ("counter", "seed", "words"),
    [
        ([0] * 4, 0, "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        ([0xFFFFFFFF] * 4, (1 << 64) - 1, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        (
            [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
            0x299F31D0A4093822,
            "d16cfe09 94fdcceb 5001e420 24126ea1",
        ),
    ],
)
def test_the_published_results_of_random123_are_reproduced(counter, seed, words):
    drawn = philox(np.array(counter, dtype=np.uint64)[:, None], seed)[:, 0]

    assert " ".join(f"{word:08x}" for word in drawn) == words


@given(st.tuples(_WORD, _WORD, _WORD, _WORD), st.integers(0, (1 << 64) - 1))
def test_every_draw_matches_plain_integers(counter, seed):
    drawn = philox(np.array(counter, dtype=np.uint64)[:, None], seed)

    assert drawn[:, 0].tolist() == oracle.philox(counter, [seed & 0xFFFFFFFF, seed >> 32])
