"""Pseudorandom Gaussians and symbols, for streams with varied content."""

from collections.abc import Mapping, Sequence

from making.changes import CodedGaussian, SymbolChoice

_HASH_MULTIPLIER = 0x9E3779B1


def hash_numbers(*numbers: int) -> int:
    """Return a 32-bit hash of the numbers."""
    value = 0x12345
    for number in numbers:
        value = (value ^ (number + 0x7F4A7C15)) * _HASH_MULTIPLIER % (1 << 32)
        value ^= value >> 15
    return value


def pick_between(minimum: int, maximum: int, *numbers: int) -> int:
    """Return a pseudorandom number from `minimum` to `maximum`, derived only from `numbers`."""
    return minimum + hash_numbers(*numbers) % (maximum - minimum + 1)


def make_cloud(
    count: int, seed: int = 0, sh_degree: int = 1, limit: int = 60
) -> list[CodedGaussian]:
    """Return pseudorandom Gaussians with coordinates from -`limit` to `limit` position steps."""
    return [_make_random_gaussian(i, seed, sh_degree, limit) for i in range(count)]


def _make_random_gaussian(i: int, seed: int, sh_degree: int, limit: int) -> CodedGaussian:
    position = tuple(pick_between(-limit, limit, seed, i, axis) for axis in range(3))
    rotation = (
        hash_numbers(seed, i, 3) % 4,
        *(pick_between(-120, 120, seed, i, 4 + k) for k in range(3)),
    )
    scales = [pick_between(-60, -20, seed, i, 8 + k) for k in range(3)]
    colors = [pick_between(-50, 50, seed, i, 12 + k) for k in range(3)]
    sh_rest = [pick_between(-3, 3, seed, i, 16 + k) // 2 for k in range(9 * sh_degree)]
    codes = (*scales, pick_between(-30, 40, seed, i, 11), *colors, *sh_rest)
    return CodedGaussian(position, rotation, codes)  # type: ignore[arg-type]


def make_births(parents: Sequence[int], seed: int, sh_degree: int = 1) -> tuple[CodedGaussian, ...]:
    """Return a pseudorandom birth near each parent, given the indices of the parents."""
    gaussians = make_cloud(len(parents), seed, sh_degree, 6)
    pairs = zip(gaussians, sorted(parents), strict=True)
    return tuple(
        CodedGaussian(gaussian.position, gaussian.rotation, gaussian.codes, parent)
        for gaussian, parent in pairs
    )


def make_moving_symbols(
    channels: int, seed: int, *, anchors_per_moving_anchor: int = 2, limit: int = 3
) -> SymbolChoice:
    """Return symbols of magnitude up to `limit`.

    About one in `anchors_per_moving_anchor` anchors moves.
    """

    def symbols(level: int, anchor: int) -> Sequence[int] | None:
        if hash_numbers(seed, level, anchor) % anchors_per_moving_anchor:
            return None
        return [
            pick_between(-limit, limit, seed, level, anchor, channel) for channel in range(channels)
        ]

    return symbols


def select_symbols(*entries: tuple[int, int, Sequence[int]]) -> SymbolChoice:
    """Return a function that gives the anchors in `entries` their symbols; no others move."""
    symbols_by_anchor = {(level, anchor): symbols for level, anchor, symbols in entries}
    return lambda level, anchor: symbols_by_anchor.get((level, anchor))


def choose_varied_codes(_model: str, context: int, zeros: int, ones: int) -> int:
    """Return a probability code that varies with the context and favors the more frequent bit."""
    base = 60 + 3 * context % 59
    return base + 120 if ones > zeros else base


def choose_some_codes(model: str, context: int, zeros: int, ones: int) -> int | None:
    """Return a probability code for about half of the contexts of each plane, else None."""
    if hash_numbers(context, zeros, ones) % 2:
        return None
    return choose_varied_codes(model, context, zeros, ones)


def fill_fields(
    field_ranges: Mapping[str, range], values_by_field: Mapping[str, tuple[int, ...] | int]
) -> tuple[int, ...]:
    """Return the numbers of all fields in order; fields that are not given are 0.

    Args:
        field_ranges: Range of the indices of each field, by name.
        values_by_field: Numbers of each given field, by the field's name with `_` in place of `-`.
    """
    numbers = [0] * max(field.stop for field in field_ranges.values())
    for name, values in values_by_field.items():
        field = field_ranges[name.replace("_", "-")]
        numbers[field.start : field.stop] = [values] if isinstance(values, int) else values
    return tuple(numbers)
