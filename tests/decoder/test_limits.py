import pytest

from quarc_ref.decoder.limits import check_birth_count, check_gaussian_count, find_max_births
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import CountLevelError, LimitError
from quarc_ref.format.records import StreamHeader


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
