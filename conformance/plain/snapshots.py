"""Survivors of a snapshot, SPEC 8.9 and 7.9, in plain integers, written from SPEC alone."""

from plain.planes import PlainSection, fixed, signed
from plain.state import PlainCoded, Vector

# By index in the CANO: the differences of a remaining Gaussian.
Survivors = dict[int, Vector]

_FIELDS = {
    "position": range(3),
    "rotation": range(3, 7),
    "log-scales": range(7, 10),
    "opacity": range(10, 11),
    "SH DC": range(11, 14),
}


def read_survivors(section: PlainSection, count: int) -> Survivors:
    """Which Gaussians of the CANO remain, and their differences."""
    lives = section.plane("survivors, lives", "", [0] * count)
    kept = [i for i, bit in enumerate(lives) if bit]
    differences: list[Vector] = [[0] * 14 for _ in kept]
    answers = [0] * len(kept)
    for number, name in enumerate(_FIELDS):
        bits = section.plane(f"survivors, {name}", "", answers)
        answers = [a + (bit << number) for a, bit in zip(answers, bits, strict=True)]
    for number, (name, numbers) in enumerate(_FIELDS.items()):
        there = [d for d, a in zip(differences, answers, strict=True) if a >> number & 1]
        if name == "rotation":
            indices = fixed(section, "survivors, index", [0] * len(there), 2)
            for difference, index in zip(there, indices, strict=True):
                difference[numbers.start] = index
            numbers = numbers[1:]
        sums = [0] * len(there)
        for r in numbers:
            contexts = [8 * r + min(s.bit_length(), 7) for s in sums]
            coded = signed(section, "survivors, differences", contexts, 4)
            sums = [s + abs(value) for s, value in zip(sums, coded, strict=True)]
            last = 0
            for difference, value in zip(there, coded, strict=True):
                last = value + last if name == "position" else value
                difference[r] = last
    return dict(zip(kept, differences, strict=True))


def add_differences(canonical: list[PlainCoded], survivors: Survivors) -> list[PlainCoded]:
    """The remaining Gaussians of the CANO, with their changes."""
    return [_add(canonical[i], difference) for i, difference in survivors.items()]


def sort(gaussians: list[PlainCoded]) -> list[PlainCoded]:
    """In the order of their Morton keys."""
    least = [min(g.position[axis] for g in gaussians) for axis in range(3)]
    far = max(g.position[axis] - least[axis] for g in gaussians for axis in range(3))
    assert far < 1 << 20, "symbol-range"
    return sorted(gaussians, key=lambda g: _morton(g.position, least))


def _add(g: PlainCoded, difference: Vector) -> PlainCoded:
    position = [p + d for p, d in zip(g.position, difference[:3], strict=True)]
    j, components = difference[3], difference[4:7]
    if j == 0:
        components = [c + d for c, d in zip(g.rotation[1:], components, strict=True)]
    codes = [c + d for c, d in zip(g.codes[:7], difference[7:], strict=True)]
    return PlainCoded(position, [(g.rotation[0] + j) % 4, *components], codes + g.codes[7:])


def _morton(position: Vector, least: Vector) -> int:
    offsets = [p - o for p, o in zip(position, least, strict=True)]
    return sum((v >> b & 1) << (3 * b + 2 - a) for a, v in enumerate(offsets) for b in range(20))
