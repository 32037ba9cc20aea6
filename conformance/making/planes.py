"""Planes of the sections of hand-written frames (SPEC 8.5 to 8.9)."""

from collections.abc import Sequence

from making import writing
from making.changes import Change, CodedGaussian, Survivor, Update
from making.payloads import Head
from making.writing import Bits


def compute_morton_key(position: Sequence[int], origin: Sequence[int]) -> int:
    """Return the Morton key of a position relative to an origin (SPEC 8.5)."""
    offsets = [
        coordinate - origin_coordinate
        for coordinate, origin_coordinate in zip(position, origin, strict=True)
    ]
    if not any(offsets):
        return 0
    return sum(
        (offset >> bit & 1) << (3 * bit + 2 - axis)
        for axis, offset in enumerate(offsets)
        for bit in range(22)
    )


def make_canonical_planes(
    head: Head, keys: list[int], gaussians: Sequence[CodedGaussian]
) -> list[list[Bits]]:
    """Return the planes of the six sections of coded Gaussians (SPEC 8.5)."""
    codes = _list_code_rows(head, gaussians)
    rotation_rows = list(zip(*(g.rotation for g in gaussians), strict=True)) or [()] * 4
    sh_rest_planes = (
        [bits for row in codes[7:] for bits in writing.make_signed_planes(row)]
        if head.sh_degree
        else []
    )
    return [
        writing.make_ascending_planes(keys),
        writing.make_row_planes(*_make_coded_color_rows(codes)),
        writing.make_row_planes(codes[3]),
        writing.make_row_planes(*codes[:3]),
        writing.make_fixed_planes(rotation_rows[0], 2)
        + writing.make_row_planes(*rotation_rows[1:]),
        sh_rest_planes,
    ]


def make_birth_planes(head: Head, births: Sequence[CodedGaussian]) -> list[Bits]:
    """Return the planes of births (SPEC 8.6)."""
    codes = _list_code_rows(head, births)
    rotation_rows = list(zip(*(g.rotation for g in births), strict=True)) or [()] * 4
    x, y, z = codes[:3]
    scale_differences = (x, _subtract(y, x), _subtract(z, y))
    planes = [
        *writing.make_ascending_planes([g.parent for g in births]),
        *writing.make_row_planes(*zip(*(g.position for g in births), strict=True)),
        *writing.make_row_planes(*_make_coded_color_rows(codes)),
        *writing.make_row_planes(codes[3]),
        *writing.make_row_planes(*scale_differences),
        *writing.make_fixed_planes(rotation_rows[0], 2),
        *writing.make_row_planes(*rotation_rows[1:]),
    ]
    return planes + (writing.make_row_planes(*codes[7:]) if head.sh_degree else [])


def make_motion_planes(head: Head, anchor_counts: list[int], change: Change) -> list[Bits]:
    """Return the planes of motion, given the number of anchors of each level (SPEC 8.7)."""
    channels = 3 + head.rotation_components
    planes = []
    for level in range(len(anchor_counts), 0, -1):
        anchor_symbols = [
            change.choose_symbols(level, anchor) for anchor in range(anchor_counts[level - 1])
        ]
        moving_symbols = [symbols for symbols in anchor_symbols if symbols is not None]
        nonzero_symbols = [
            s[channel] for channel in range(channels) for s in moving_symbols if s[channel]
        ]
        planes.append([int(symbols is not None) for symbols in anchor_symbols])
        planes += [[int(s[channel] != 0) for s in moving_symbols] for channel in range(channels)]
        planes.append([int(symbol < 0) for symbol in nonzero_symbols])
        magnitudes = [abs(symbol) for symbol in nonzero_symbols]
        planes += [[int(v > i + 1) for v in magnitudes if v > i] for i in range(64)]
    return planes


def make_update_planes(gaussian_count: int, updates: Sequence[Update]) -> list[Bits]:
    """Return the planes of the updates of a scene with `gaussian_count` Gaussians (SPEC 8.8)."""
    updated_indices = {update.gaussian_index for update in updates}
    changing_updates = [update for update in updates if update.residuals is not None]
    field_masks = [
        _make_field_mask(update.residuals, update.field_mask, _UPDATE_FIELD_RANGES)
        for update in changing_updates
    ]
    planes = [
        [int(i in updated_indices) for i in range(gaussian_count)],
        [int(update.residuals is None) for update in updates],
        *(
            [field_mask >> field_number & 1 for field_mask in field_masks]
            for field_number in range(len(_UPDATE_FIELD_RANGES))
        ),
    ]
    for field_number, rows in enumerate(_UPDATE_FIELD_RANGES):
        updates_with_field = [
            u
            for u, field_mask in zip(changing_updates, field_masks, strict=True)
            if field_mask >> field_number & 1
        ]
        for row in rows:
            planes += writing.make_signed_planes(
                [u.residuals[row] for u in updates_with_field if u.residuals is not None]
            )
    return planes


def make_survivor_planes(canonical_count: int, survivors: Sequence[Survivor]) -> list[Bits]:
    """Return the planes of the survivors of a CANO with `canonical_count` Gaussians (SPEC 8.9)."""
    survivor_indices = {survivor.index for survivor in survivors}
    field_masks = [
        _make_field_mask(s.differences, s.field_mask, _SURVIVOR_FIELD_RANGES) for s in survivors
    ]
    planes = [
        [int(i in survivor_indices) for i in range(canonical_count)],
        *(
            [field_mask >> field_number & 1 for field_mask in field_masks]
            for field_number in range(5)
        ),
    ]
    for field_number, rows in enumerate(_SURVIVOR_FIELD_RANGES):
        survivors_with_field = [
            s for s, mask in zip(survivors, field_masks, strict=True) if mask >> field_number & 1
        ]
        for row in rows:
            values = [s.differences[row] for s in survivors_with_field]
            if field_number == 0:
                values = [v - previous for v, previous in zip(values, [0, *values], strict=False)]
            planes += (
                writing.make_fixed_planes(values, 2)
                if row == 3
                else writing.make_signed_planes(values)
            )
    return planes


_UPDATE_FIELD_RANGES = (range(3), range(3, 6), range(6, 9), range(9, 10), range(10, 13))


_SURVIVOR_FIELD_RANGES = (range(3), range(3, 7), range(7, 10), range(10, 11), range(11, 14))


def _make_field_mask(
    numbers: Sequence[int] | None, field_mask: int | None, field_rows: Sequence[range]
) -> int:
    """Return `field_mask` or, if it is None, the mask of the fields with a nonzero number."""
    if field_mask is not None or numbers is None:
        return field_mask or 0
    has_nonzero = (any(numbers[row] for row in field) for field in field_rows)
    return sum(bit << field_number for field_number, bit in enumerate(has_nonzero))


def _list_code_rows(head: Head, gaussians: Sequence[CodedGaussian]) -> list[tuple[int, ...]]:
    """Return the codes of the Gaussians as rows; missing SH rest codes are 0."""
    width = 16 if head.sh_degree else 7
    return (
        list(zip(*((g.codes + (0,) * 9)[:width] for g in gaussians), strict=True)) or [()] * width
    )


def _make_coded_color_rows(codes: Sequence[Sequence[int]]) -> list[list[int]]:
    red, green, blue = codes[4:7]
    return [list(green), _subtract(red, green), _subtract(blue, green)]


def _subtract(row: Sequence[int], subtrahend: Sequence[int]) -> list[int]:
    return [a - b for a, b in zip(row, subtrahend, strict=True)]
