"""The planes of every section of hand-written content (SPEC 8.5 to 8.9)."""

from collections.abc import Sequence

from making import writing
from making.changes import Change, Coded, Survivor, Update
from making.payloads import Head
from making.writing import Bits


def morton(position: Sequence[int], origin: Sequence[int]) -> int:
    """Return the key of a position (SPEC 8.5)."""
    offsets = [p - o for p, o in zip(position, origin, strict=True)]
    if not any(offsets):
        return 0
    return sum((v >> b & 1) << (3 * b + 2 - a) for a, v in enumerate(offsets) for b in range(22))


def canonical_planes(head: Head, keys: list[int], gaussians: Sequence[Coded]) -> list[list[Bits]]:
    """Return the planes of the six sections (SPEC 8.5)."""
    codes = _code_rows(head, gaussians)
    turned = list(zip(*(g.rotation for g in gaussians), strict=True)) or [()] * 4
    rest = [bits for row in codes[7:] for bits in writing.signed(row)] if head.sh_degree else []
    return [
        writing.ascending(keys),
        writing.rows(*_colors(codes)),
        writing.rows(codes[3]),
        writing.rows(*codes[:3]),
        writing.fixed(turned[0], 2) + writing.rows(*turned[1:]),
        rest,
    ]


def birth_planes(head: Head, births: Sequence[Coded]) -> list[Bits]:
    """Return the planes of births (SPEC 8.6)."""
    codes = _code_rows(head, births)
    turned = list(zip(*(g.rotation for g in births), strict=True)) or [()] * 4
    x, y, z = codes[:3]
    steps = (x, _subtract(y, x), _subtract(z, y))
    planes = [
        *writing.ascending([g.parent for g in births]),
        *writing.rows(*zip(*(g.position for g in births), strict=True)),
        *writing.rows(*_colors(codes)),
        *writing.rows(codes[3]),
        *writing.rows(*steps),
        *writing.fixed(turned[0], 2),
        *writing.rows(*turned[1:]),
    ]
    return planes + (writing.rows(*codes[7:]) if head.sh_degree else [])


def motion_planes(head: Head, counts: list[int], change: Change) -> list[Bits]:
    """Return the planes of the motion of a number of anchors of each level (SPEC 8.7)."""
    channels = 3 + head.rotation_components
    planes = []
    for level in range(len(counts), 0, -1):
        given = [change.symbols(level, anchor) for anchor in range(counts[level - 1])]
        moving = [symbols for symbols in given if symbols is not None]
        there = [s[channel] for channel in range(channels) for s in moving if s[channel]]
        planes.append([int(symbols is not None) for symbols in given])
        planes += [[int(s[channel] != 0) for s in moving] for channel in range(channels)]
        planes.append([int(symbol < 0) for symbol in there])
        sizes = [abs(symbol) for symbol in there]
        planes += [[int(v > i + 1) for v in sizes if v > i] for i in range(64)]
    return planes


def update_planes(count: int, updates: Sequence[Update]) -> list[Bits]:
    """Return the planes of updates of a scene with a number of Gaussians (SPEC 8.8)."""
    chosen = {update.gaussian for update in updates}
    left = [update for update in updates if update.residuals is not None]
    answers = [_answers_of(update.residuals, update.fields, _FIELDS) for update in left]
    planes = [
        [int(i in chosen) for i in range(count)],
        [int(update.residuals is None) for update in updates],
        *([answer >> number & 1 for answer in answers] for number in range(len(_FIELDS))),
    ]
    for number, rows in enumerate(_FIELDS):
        there = [u for u, answer in zip(left, answers, strict=True) if answer >> number & 1]
        for row in rows:
            planes += writing.signed([u.residuals[row] for u in there if u.residuals is not None])
    return planes


def survivor_planes(count: int, survivors: Sequence[Survivor]) -> list[Bits]:
    """Return the planes of the survivors of a CANO with a number of Gaussians (SPEC 8.9)."""
    kept = {survivor.index for survivor in survivors}
    answers = [_answers_of(s.differences, s.fields, _SURVIVOR_FIELDS) for s in survivors]
    planes = [
        [int(i in kept) for i in range(count)],
        *([answer >> number & 1 for answer in answers] for number in range(5)),
    ]
    for number, rows in enumerate(_SURVIVOR_FIELDS):
        there = [s for s, a in zip(survivors, answers, strict=True) if a >> number & 1]
        for row in rows:
            values = [s.differences[row] for s in there]
            if number == 0:
                values = [v - last for v, last in zip(values, [0, *values], strict=False)]
            planes += writing.fixed(values, 2) if row == 3 else writing.signed(values)
    return planes


_FIELDS = (range(3), range(3, 6), range(6, 9), range(9, 10), range(10, 13))


_SURVIVOR_FIELDS = (range(3), range(3, 7), range(7, 10), range(10, 11), range(11, 14))


def _answers_of(numbers: Sequence[int] | None, fields: int | None, rows: Sequence[range]) -> int:
    """Return the changed fields, a bit for each: as given, or those that are not 0."""
    if fields is not None or numbers is None:
        return fields or 0
    there = (any(numbers[row] for row in field) for field in rows)
    return sum(bit << number for number, bit in enumerate(there))


def _code_rows(head: Head, gaussians: Sequence[Coded]) -> list[tuple[int, ...]]:
    """Return the rows of codes; missing SH rest is 0."""
    width = 16 if head.sh_degree else 7
    return (
        list(zip(*((g.codes + (0,) * 9)[:width] for g in gaussians), strict=True)) or [()] * width
    )


def _colors(codes: Sequence[Sequence[int]]) -> list[list[int]]:
    red, green, blue = codes[4:7]
    return [list(green), _subtract(red, green), _subtract(blue, green)]


def _subtract(row: Sequence[int], other: Sequence[int]) -> list[int]:
    return [a - b for a, b in zip(row, other, strict=True)]
