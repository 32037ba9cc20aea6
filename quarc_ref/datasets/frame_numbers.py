"""Compares the numbers in the names of pictures, which tell the frames of a recording."""

import re
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.findings import FRAME_NUMBERS, Finding
from quarc_ref.datasets.pictures import Pictures


def list_last_numbers(names: Sequence[str]) -> list[int]:
    """Return the last number in each name; an empty list if a name has no number."""
    matches = [re.search(r"([0-9]{1,18})[^0-9]*$", name) for name in names]
    numbers = [int(match[1]) for match in matches if match]
    return numbers if len(numbers) == len(names) else []


def find_gap(names: Sequence[str]) -> tuple[str, str] | None:
    """Return the names before and after the first gap in the last numbers of the names.

    A gap is a step between two numbers that is larger than the smallest step. The result is None if
    there is no gap, or if a name has no number.
    """
    steps = [second - first for first, second in pairwise(list_last_numbers(names))]
    smallest_step = min(steps, default=0)
    for pair, step in zip(pairwise(names), steps, strict=False):
        if step != smallest_step:
            return pair
    return None


def compare_first_numbers(names: Sequence[str], source: Pictures) -> tuple[Finding, ...]:
    """Return a finding for each camera whose pictures begin with another number.

    Cameras with fewer than two numbered pictures, such as videos, are not compared. Neither are
    numbers with hardly any in common with the other cameras, because each camera counts on its own.

    Args:
        names: `[camera]` names of the cameras, at least one.
        source: Pictures of the cameras, whose numbers have no gaps.
    """
    numbers = [list_last_numbers([path.stem for path in paths]) for paths in source.paths]
    sequences = [sequence for sequence in numbers if len(set(sequence)) > 1]
    if not sequences:
        return ()
    ((common_first, _), *_) = Counter(sequence[0] for sequence in sequences).most_common()
    reference = next(sequence for sequence in sequences if sequence[0] == common_first)
    return tuple(
        _make_finding(name, sequence, reference)
        for name, sequence in zip(names, numbers, strict=True)
        if sequence in sequences
        and sequence[0] != common_first
        and 2 * len({*sequence} & {*reference}) >= min(len(sequence), len(reference))
    )


def _make_finding(name: str, numbers: Sequence[int], reference: Sequence[int]) -> Finding:
    offset = (reference[0] - numbers[0]) / (numbers[1] - numbers[0])
    message = (
        f"the pictures of {name} begin with number {numbers[0]}, and those of other cameras with "
        f"{reference[0]}, but the first pictures of all cameras become frame 0: if equal numbers "
        f'are the same moment, write offsets to {NOTES_NAME} ("offsets": {{"{name}": {offset:g}}})'
    )
    return Finding(FRAME_NUMBERS, message, (name,))
