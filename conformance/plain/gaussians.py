"""Reads coded Gaussians (SPEC 8.5, 8.6) in plain integers; written from SPEC.md alone."""

from plain.planes import (
    PlainSection,
    Row,
    read_ascending,
    read_fixed,
    read_rows_by_context,
    read_rows_in_one_context,
    read_signed,
)


def read_keys(section: PlainSection, name: str, count: int) -> Row:
    """Return Morton keys or parent indices, in ascending order."""
    return read_ascending(section, name, count, 6)


def read_colors(section: PlainSection, name: str, count: int) -> list[Row]:
    """Return the SH DC codes as three rows: red, green, blue."""
    green, red, blue = read_rows_by_context(section, name, count, 3) or [[], [], []]
    return [_add_rows(red, green), green, _add_rows(blue, green)]


def read_rotations(section: PlainSection, name: str, count: int) -> list[tuple[int, Row]]:
    """Return (j, [a, b, c]) of each Gaussian, as in SPEC 7.2."""
    indices = read_fixed(section, f"{name}, index", [0] * count, 2)
    components = zip(*read_rows_by_context(section, name, count, 3), strict=True)
    return [
        (j, list(component_triple)) for j, component_triple in zip(indices, components, strict=True)
    ]


def read_log_scales(section: PlainSection, name: str, count: int) -> list[Row]:
    """Return the log-scales x, y, z of births; y is coded relative to x, and z relative to y."""
    x, y, z = read_rows_by_context(section, name, count, 3) or [[], [], []]
    y = _add_rows(x, y)
    return [x, y, _add_rows(y, z)]


def read_sh_rest(section: PlainSection, name: str, count: int) -> list[Row]:
    """Return the nine rows of SH rest of a canonical frame."""
    rows: list[Row] = []
    sums = [0] * count
    for number in range(9):
        contexts = [8 * number + min(s.bit_length(), 7) for s in sums]
        rows.append(read_signed(section, name, contexts, 4))
        sums = [s + abs(value) for s, value in zip(sums, rows[-1], strict=True)]
    return rows


def read_newborn_sh_rest(section: PlainSection, name: str, count: int) -> list[Row]:
    return read_rows_in_one_context(section, name, count, 9)


def _add_rows(first: Row, second: Row) -> Row:
    return [a + b for a, b in zip(first, second, strict=True)]
