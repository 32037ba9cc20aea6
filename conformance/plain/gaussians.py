"""The Gaussians of SPEC 8.5 and 8.6 in plain Python integers, written from SPEC alone."""

from plain.planes import (
    PlainSection,
    Row,
    ascending,
    fixed,
    rows_in_contexts,
    rows_in_one_context,
    signed,
)


def read_keys(section: PlainSection, name: str, count: int) -> Row:
    """Morton keys, or indices of parents."""
    return ascending(section, name, count, 6)


def read_colors(section: PlainSection, name: str, count: int) -> list[Row]:
    """SH DC of red, green, blue."""
    green, red, blue = rows_in_contexts(section, name, count, 3) or [[], [], []]
    return [_add(red, green), green, _add(blue, green)]


def read_rotations(section: PlainSection, name: str, count: int) -> list[tuple[int, Row]]:
    """For each Gaussian j and a, b, c."""
    indices = fixed(section, f"{name}, index", [0] * count, 2)
    others = zip(*rows_in_contexts(section, name, count, 3), strict=True)
    return [(j, list(abc)) for j, abc in zip(indices, others, strict=True)]


def read_log_scales(section: PlainSection, name: str, count: int) -> list[Row]:
    """Log-scales x, y, z of births, each coded relative to the previous one."""
    x, y, z = rows_in_contexts(section, name, count, 3) or [[], [], []]
    y = _add(x, y)
    return [x, y, _add(y, z)]


def read_rest(section: PlainSection, name: str, count: int) -> list[Row]:
    """SH rest of a canonical frame, row by row."""
    rows: list[Row] = []
    sums = [0] * count
    for number in range(9):
        contexts = [8 * number + min(s.bit_length(), 7) for s in sums]
        rows.append(signed(section, name, contexts, 4))
        sums = [s + abs(value) for s, value in zip(sums, rows[-1], strict=True)]
    return rows


def read_newborn_rest(section: PlainSection, name: str, count: int) -> list[Row]:
    return rows_in_one_context(section, name, count, 9)


def _add(first: Row, second: Row) -> Row:
    return [a + b for a, b in zip(first, second, strict=True)]
