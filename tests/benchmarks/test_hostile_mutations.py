from pathlib import Path

import pytest

from hostile.mutations import Mutator
from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams import decode
from quarc_ref.streams.chunk_reader import split_chunks

SEEDS = {
    path.stem: path.read_bytes()
    for path in (Path(__file__).parents[1] / "hostile" / "seeds" / "streams").glob("*.quarc")
}


@pytest.fixture(scope="module")
def mutants():
    mutator = Mutator(SEEDS, series=3)
    return [mutator.make(number) for number in range(400)]


def test_a_series_and_a_number_reproduce_the_mutant(mutants):
    same_series = Mutator(dict(reversed(SEEDS.items())), series=3)
    other_series = Mutator(SEEDS, series=4)

    assert [same_series.make(number) for number in (399, 0, 7)] == [mutants[i] for i in (399, 0, 7)]
    assert [other_series.make(number) for number in range(50)] != mutants[:50]


def test_most_mutants_differ_and_are_small(mutants):
    assert len({mutant.data for mutant in mutants}) > 0.8 * len(mutants)
    assert max(len(mutant.data) for mutant in mutants) < 1 << 16


def _has_whole_chunks(data):
    try:
        return len(list(split_chunks(data))) > 0
    except BitstreamError:
        return False


def test_half_of_the_mutants_are_forged_so_that_all_crcs_hold(mutants):
    forged_mutants = [mutant for mutant in mutants if _has_whole_chunks(mutant.data)]

    assert len(mutants) / 4 < len(forged_mutants) < 3 * len(mutants) / 4


def test_every_seed_and_every_kind_of_mutation_is_used(mutants):
    mutation_names = {step for mutant in mutants for step in mutant.recipe[1:]}

    assert {mutant.recipe[0] for mutant in mutants} == set(SEEDS)
    assert {"flip", "splice", "flip in a payload", "change_words", "swap_chunks"} <= mutation_names


def test_mutants_reach_code_behind_the_container(mutants):
    reject_ids = set()
    for mutant in mutants:
        try:
            list(decode(mutant.data))
        except BitstreamError as error:
            reject_ids.add(error.reject_id)

    assert {"unconsumed-words", "state-crc", "frame-order", "field", "payload-crc"} <= reject_ids
