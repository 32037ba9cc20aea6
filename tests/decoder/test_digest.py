import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.decoder import digest


@given(st.lists(st.binary(max_size=300), max_size=8))
def test_a_crc_of_parts_is_zlib_s_of_the_whole(parts):
    crc = 0
    for part in parts:
        crc = digest.crc32(memoryview(part), crc)

    assert crc == zlib.crc32(b"".join(parts))


def test_where_isa_l_is_installed_it_makes_the_crcs():
    fast = pytest.importorskip("isal.isal_zlib", reason="ISA-L is not installed")

    assert digest.crc32 is fast.crc32
