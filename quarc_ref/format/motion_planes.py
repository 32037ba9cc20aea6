"""The residuals of a frame's anchors as planes: SPEC 8.7.

Levels go from coarse to fine. Of each anchor it is asked first whether it
moves at all; only of those that do, channel by channel, whether a symbol is
not 0, its sign, and its magnitude in unary. What the parent anchor does, and
what the anchor's Gaussian did in the last frame, are the contexts.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import MAGNITUDE_PLANES, SYMBOL_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.planes import PlaneReader, Planes, PlaneWriter
from quarc_ref.format.records import Section

_TRANSLATION_ROWS = 3
_ROTATION_ROWS = 3


@dataclass(frozen=True, slots=True)
class LevelContext:
    """What both sides know of a level's anchors before its symbols.

    Attributes:
        parents: `[a]` index in the next coarser level of each anchor's parent.
        previous: `[c, a]` motion of each anchor's Gaussian in the last frame:
            the sum of its levels' symbols, 0 where there is none.
    """

    parents: Int64
    previous: Int64


def write_motion(levels: Sequence[LevelContext], symbols: Sequence[Int64]) -> Section:
    """Code the symbols of a frame; an empty section where all are 0.

    Args:
        levels: Contexts, level 1 (the finest) first.
        symbols: `[c, a]` of each level, level 1 first.

    Raises:
        EncodeError: A symbol is beyond 65.
    """
    if any(np.any(np.abs(level) > SYMBOL_LIMIT) for level in symbols):
        message = f"a symbol is beyond {SYMBOL_LIMIT}: take a larger step"
        raise EncodeError(message)
    if not any(np.any(level) for level in symbols):
        return Section(b"", np.zeros(0, dtype=np.uint32))
    writer = PlaneWriter()
    _walk_motion(writer, levels, symbols)
    return writer.section()


def read_motion(section: Section, levels: Sequence[LevelContext]) -> list[Int64]:
    """Decode the symbols of a frame.

    Args:
        section: As the FRAM chunk holds it.
        levels: Contexts, level 1 (the finest) first.

    Returns:
        `[c, a]` of each level, level 1 first.

    Raises:
        EntropyError: The section is malformed.
    """
    blank = [np.zeros_like(level.previous) for level in levels]
    if section.is_empty():
        return blank
    reader = PlaneReader(section)
    symbols = _walk_motion(reader, levels, blank)
    reader.finish()
    return symbols


def _walk_motion(
    planes: Planes, levels: Sequence[LevelContext], symbols: Sequence[Int64]
) -> list[Int64]:
    coded: list[Int64] = []
    for level, values in zip(reversed(levels), reversed(symbols), strict=True):
        parents = coded[-1][:, level.parents] if coded else np.zeros_like(values)
        coded.append(_walk_level(planes, parents, level.previous, values))
    return coded[::-1]


def _walk_level(planes: Planes, parents: Int64, previous: Int64, values: Int64) -> Int64:
    """Code one level; all arrays are `[c, a]`."""
    contexts = _FLAG_PREVIOUS * _bucket(parents, _PARENT_BORDERS) + _bucket(
        previous, _PREVIOUS_BORDERS
    )
    moving = np.flatnonzero(planes.code(contexts, np.any(values, axis=0)))
    coded = np.zeros_like(values)
    for rows in _groups(values.shape[0]):
        asked = (rows, moving)
        coded[asked] = _walk_group(planes, parents[asked], previous[asked], values[asked])
    return coded


def _walk_group(planes: Planes, parents: Int64, previous: Int64, values: Int64) -> Int64:
    """Code a group's channels of the anchors that move; all arrays are `[g, m]`."""
    parents, previous, flat = parents.reshape(-1), previous.reshape(-1), values.reshape(-1)
    near = np.minimum(np.abs(parents), 2)
    last = np.minimum((np.abs(previous) + 1) >> 1, 2)
    there = np.flatnonzero(planes.code(3 * near + last, flat != 0))
    negative = planes.code(np.sign(parents[there]) + 1, flat[there] < 0)
    magnitudes = _walk_magnitudes(planes, parents[there], np.abs(flat[there]))
    coded = np.zeros_like(flat)
    coded[there] = np.where(negative, -magnitudes, magnitudes)
    return coded.reshape(values.shape)


def _walk_magnitudes(planes: Planes, parents: Int64, values: Int64) -> Int64:
    """Code magnitudes above 0 in unary, `[n]`."""
    coded = np.ones_like(values)
    near = np.minimum(np.abs(parents), 3)
    left = np.arange(values.size)
    for plane in range(MAGNITUDE_PLANES):
        contexts = near[left] if plane < _PLANES_OF_PARENT else np.zeros_like(left)
        left = left[planes.code(contexts, values[left] > plane + 1)]
        coded[left] += 1
    return coded


def _bucket(symbols: Int64, borders: Int64) -> Int64:
    """Return `[a]` the class of the sum of magnitudes over the channels `[c, a]`."""
    sums: Int64 = np.abs(symbols).sum(axis=0)
    return np.searchsorted(borders, sums, side="right")


def _groups(channels: int) -> list[Int64]:
    """Return the rows of translation, of w (maybe none), of rotation xyz; each `[g, 1]`."""
    return np.split(np.arange(channels)[:, None], [_TRANSLATION_ROWS, channels - _ROTATION_ROWS])


_FLAG_PREVIOUS = 5
_PARENT_BORDERS = np.array([1, 2, 4])
_PREVIOUS_BORDERS = np.array([1, 2, 4, 8])
_PLANES_OF_PARENT = 2
