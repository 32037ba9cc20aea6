from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.gaussian_planes import (
    read_births,
    read_canonical,
    sort_canonical,
    write_births,
    write_canonical,
)
from quarc_ref.format.coding.planes import PlaneWriter
from quarc_ref.format.coding.values import code_unsigned
from quarc_ref.format.constants import CODE_LIMIT, KEY_CLASS_BITS
from quarc_ref.format.errors import EncodeError, SymbolRangeError
from quarc_ref.format.morton import interleave
from quarc_ref.format.records import SH_DC, Births, CanonicalChunk, StreamHeader
from tests import strategies
from tests.small_streams import make_gaussians


def _fields(gaussians):
    return [array.tolist() for array in (gaussians.positions, gaussians.rotations, gaussians.codes)]


@given(st.data())
def test_a_canonical_frame_is_decoded_in_morton_order(data):
    header = data.draw(strategies.headers())
    gaussians = data.draw(strategies.gaussians(header, data.draw(st.integers(1, 30))))
    origin, axis_bits, ordered = sort_canonical(gaussians)
    sections = write_canonical(ordered, origin)
    chunk = CanonicalChunk(0, gaussians.count, origin, axis_bits, sections, 0)

    decoded = read_canonical(chunk, header.code_planes)

    assert _fields(decoded) == _fields(ordered)


@given(st.data())
def test_sorting_keeps_the_attributes_of_a_gaussian_together(data):
    header = StreamHeader()
    gaussians = data.draw(strategies.gaussians(header, 20))
    _, _, ordered = sort_canonical(gaussians)

    rows = [np.concatenate([g.positions, g.rotations, g.codes]).T for g in (gaussians, ordered)]

    assert sorted(map(tuple, rows[0].tolist())) == sorted(map(tuple, rows[1].tolist()))


def test_positions_outside_the_box_are_rejected():
    header = StreamHeader()
    origin, axis_bits, ordered = sort_canonical(make_gaussians(header, 20))
    sections = write_canonical(ordered, origin)
    chunk = CanonicalChunk(0, 20, origin, axis_bits - 1, sections, 0)

    with pytest.raises(SymbolRangeError):
        read_canonical(chunk, header.code_planes)


@given(st.data())
def test_births_survive_a_round_trip(data):
    header = data.draw(strategies.headers())
    count = data.draw(st.integers(0, 20))
    births = data.draw(strategies.births(header, count, scene_count=50))

    section = write_births(births, ContextCounts())
    decoded, _ = read_births(section, header.code_planes, count, ContextCounts())

    assert decoded.parents.tolist() == births.parents.tolist()
    assert _fields(decoded.newborn) == _fields(births.newborn)


def test_births_like_those_of_the_previous_frame_cost_less():
    header, counts = StreamHeader(), ContextCounts()
    gaussians = make_gaussians(header, 40)
    births = Births(np.arange(40), replace(gaussians, positions=gaussians.positions % 9))
    first = write_births(births, counts)

    _, counts_after = read_births(first, header.code_planes, 40, counts)

    assert write_births(births, counts_after).byte_count() < first.byte_count()


def test_colors_too_far_apart_cannot_be_written():
    gaussians = make_gaussians(StreamHeader(), 1)
    codes = gaussians.codes.copy()
    codes[SH_DC] = [[CODE_LIMIT], [-CODE_LIMIT], [0]]

    with pytest.raises(EncodeError, match="apart"):
        write_canonical(replace(gaussians, codes=codes), tuple(gaussians.positions[:, 0].tolist()))


def test_a_parent_beyond_the_largest_number_is_rejected():
    writer = PlaneWriter(ContextCounts())
    parents = np.array([1 << 61], dtype=np.int64)
    code_unsigned(writer, "births parents", np.zeros_like(parents), KEY_CLASS_BITS, parents)

    with pytest.raises(SymbolRangeError, match="ascending"):
        read_births(writer.section(), 7, 1, ContextCounts())


def test_sections_are_ordered_by_importance_for_a_picture():
    header = StreamHeader()
    origin, _, ordered = sort_canonical(make_gaussians(header, 500))
    position_sections = write_canonical(
        type(ordered)(ordered.positions, 0 * ordered.rotations, 0 * ordered.codes), origin
    )
    all_sections = write_canonical(ordered, origin)

    is_larger = [
        a.byte_count() > b.byte_count()
        for a, b in zip(all_sections, position_sections, strict=True)
    ]

    assert is_larger == [False, True, True, True, True, True]
    assert np.all(np.diff(interleave(ordered.positions - np.array(origin)[:, None])) >= 0)
