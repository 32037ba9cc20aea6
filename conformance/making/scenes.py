"""Hand-written Gaussians, and patterns that fill streams with various values."""

from collections.abc import Mapping, Sequence

from making.changes import Coded, Symbols

_MIXER = 0x9E3779B1


def pick(*numbers: int) -> int:
    """Return a pseudorandom number below 2^32 that follows from others."""
    value = 0x12345
    for number in numbers:
        value = (value ^ (number + 0x7F4A7C15)) * _MIXER % (1 << 32)
        value ^= value >> 15
    return value


def between(least: int, most: int, *numbers: int) -> int:
    """Return a pseudorandom number from `least` to `most` that follows from others."""
    return least + pick(*numbers) % (most - least + 1)


def cloud(count: int, seed: int = 0, degree: int = 1, reach: int = 60) -> list[Coded]:
    """Return Gaussians in a box with various rotations and codes."""
    return [_draw(i, seed, degree, reach) for i in range(count)]


def _draw(i: int, seed: int, degree: int, reach: int) -> Coded:
    position = tuple(between(-reach, reach, seed, i, axis) for axis in range(3))
    rotation = (pick(seed, i, 3) % 4, *(between(-120, 120, seed, i, 4 + k) for k in range(3)))
    scales = [between(-60, -20, seed, i, 8 + k) for k in range(3)]
    colors = [between(-50, 50, seed, i, 12 + k) for k in range(3)]
    rest = [between(-3, 3, seed, i, 16 + k) // 2 for k in range(9 * degree)]
    codes = (*scales, between(-30, 40, seed, i, 11), *colors, *rest)
    return Coded(position, rotation, codes)  # type: ignore[arg-type]


def newborn(parents: Sequence[int], seed: int, degree: int = 1) -> tuple[Coded, ...]:
    """Return births near given parents."""
    drawn = cloud(len(parents), seed, degree, 6)
    pairs = zip(drawn, sorted(parents), strict=True)
    return tuple(Coded(g.position, g.rotation, g.codes, parent) for g, parent in pairs)


def moving(channels: int, seed: int, *, one_in: int = 2, reach: int = 3) -> Symbols:
    """Return symbols that move some of the anchors of every level."""

    def symbols(level: int, anchor: int) -> Sequence[int] | None:
        if pick(seed, level, anchor) % one_in:
            return None
        return [between(-reach, reach, seed, level, anchor, c) for c in range(channels)]

    return symbols


def only(*given: tuple[int, int, Sequence[int]]) -> Symbols:
    """Return symbols of some anchors, given as (level, anchor, symbols)."""
    known = {(level, anchor): symbols for level, anchor, symbols in given}
    return lambda level, anchor: known.get((level, anchor))


def state_some(_model: str, context: int, zeros: int, ones: int) -> int:
    """State a probability near the actual one, in various octaves."""
    base = 60 + 3 * context % 59
    return base + 120 if ones > zeros else base


def place_numbers(
    fields: Mapping[str, range], said: Mapping[str, tuple[int, ...] | int]
) -> tuple[int, ...]:
    """Return the numbers of all fields; missing fields are 0.

    Args:
        fields: The position of each field.
        said: Numbers by the name of a field, with `_` in place of `-`.
    """
    numbers = [0] * max(field.stop for field in fields.values())
    for name, values in said.items():
        field = fields[name.replace("_", "-")]
        numbers[field.start : field.stop] = [values] if isinstance(values, int) else values
    return tuple(numbers)
