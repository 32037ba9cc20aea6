import numpy as np
import pytest

from quarc_ref.decoder.frames import read_checked_snapshot
from quarc_ref.decoder.limits import check_birth_count, check_gaussian_count, find_max_births
from quarc_ref.format.coding.gaussian_planes import sort_canonical
from quarc_ref.format.coding.snapshot_planes import write_snapshot
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import CountLevelError, InvalidWordsError, LimitError
from quarc_ref.format.records import Section, SnapshotChunk, StreamHeader
from tests.small_streams import make_gaussians


@pytest.mark.parametrize("level", sorted(LEVELS))
def test_counts_above_a_level_are_rejected_and_those_above_the_decoder_declined(level):
    header = StreamHeader(level=level)
    gaussians, births, _ = LEVELS[min(level, 30)]
    error = LimitError if level == 31 else CountLevelError

    check_gaussian_count(header, gaussians)
    check_birth_count(header, births, gaussians - births)
    with pytest.raises(error):
        check_gaussian_count(header, gaussians + 1)
    with pytest.raises(error):
        check_birth_count(header, births + 1, 1)
    with pytest.raises(error):
        check_birth_count(header, 1, gaussians)


@pytest.mark.parametrize(("gaussians", "births"), [(1, 1 << 12), ((1 << 16) - 5, 5), (1 << 16, 0)])
def test_the_largest_number_of_births_is_accepted(gaussians, births):
    header = StreamHeader(level=10)

    assert find_max_births(header, gaussians) == births
    check_birth_count(header, births, gaussians)


def test_the_gaussians_of_a_snapshot_are_counted_before_new_ones_are_decoded(monkeypatch):
    header = StreamHeader(snapshots=True)
    _, _, canonical = sort_canonical(make_gaussians(header, 20))
    coded = write_snapshot(canonical, canonical, np.arange(20))
    invalid_section = Section(np.zeros(1, dtype=np.uint32))
    chunk = SnapshotChunk(1, 0, 20, (0, 0, 0), 0, coded.survivors, (invalid_section,) * 6, 0)

    with pytest.raises(InvalidWordsError):
        read_checked_snapshot(header, chunk, canonical)
    monkeypatch.setitem(LEVELS, 10, LEVELS[10]._replace(gaussians=39))
    with pytest.raises(CountLevelError):
        read_checked_snapshot(header, chunk, canonical)
