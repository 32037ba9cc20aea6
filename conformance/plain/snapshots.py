"""Reads survivors of snapshots (SPEC 7.9, 8.9) in plain integers; written from SPEC.md alone."""

from plain.planes import PlainSection, read_fixed, read_signed
from plain.state import PlainCodedGaussian, Vector

# The 14 differences of each surviving Gaussian, by its index in the CANO.
Survivors = dict[int, Vector]

_FIELD_RANGES = {
    "position": range(3),
    "rotation": range(3, 7),
    "log-scales": range(7, 10),
    "opacity": range(10, 11),
    "SH DC": range(11, 14),
}


def read_survivors(section: PlainSection, canonical_count: int) -> Survivors:
    """Return the differences of the survivors of a CANO with `canonical_count` Gaussians."""
    survival_bits = section.read_plane("survivors, lives", "", [0] * canonical_count)
    survivor_indices = [i for i, bit in enumerate(survival_bits) if bit]
    differences: list[Vector] = [[0] * 14 for _ in survivor_indices]
    field_masks = [0] * len(survivor_indices)
    for number, name in enumerate(_FIELD_RANGES):
        bits = section.read_plane(f"survivors, {name}", "", field_masks)
        field_masks = [a + (bit << number) for a, bit in zip(field_masks, bits, strict=True)]
    for number, (name, rows) in enumerate(_FIELD_RANGES.items()):
        changed = [d for d, a in zip(differences, field_masks, strict=True) if a >> number & 1]
        if name == "rotation":
            rotation_indices = read_fixed(section, "survivors, index", [0] * len(changed), 2)
            for difference, index in zip(changed, rotation_indices, strict=True):
                difference[rows.start] = index
            rows = rows[1:]
        sums = [0] * len(changed)
        for r in rows:
            contexts = [8 * r + min(s.bit_length(), 7) for s in sums]
            coded = read_signed(section, "survivors, differences", contexts, 4)
            sums = [s + abs(value) for s, value in zip(sums, coded, strict=True)]
            value_so_far = 0
            for difference, value in zip(changed, coded, strict=True):
                value_so_far = value + value_so_far if name == "position" else value
                difference[r] = value_so_far
    return dict(zip(survivor_indices, differences, strict=True))


def add_differences(
    canonical: list[PlainCodedGaussian], survivors: Survivors
) -> list[PlainCodedGaussian]:
    """Return the surviving Gaussians of the CANO with their differences added."""
    return [_add_difference(canonical[i], difference) for i, difference in survivors.items()]


def sort_by_morton_key(gaussians: list[PlainCodedGaussian]) -> list[PlainCodedGaussian]:
    """Return Gaussians in the order of their Morton keys."""
    minimum = [min(g.position[axis] for g in gaussians) for axis in range(3)]
    extent = max(g.position[axis] - minimum[axis] for g in gaussians for axis in range(3))
    assert extent < 1 << 20, "symbol-range"
    return sorted(gaussians, key=lambda g: _compute_morton_key(g.position, minimum))


def _add_difference(g: PlainCodedGaussian, difference: Vector) -> PlainCodedGaussian:
    position = [p + d for p, d in zip(g.position, difference[:3], strict=True)]
    j, components = difference[3], difference[4:7]
    if j == 0:
        components = [c + d for c, d in zip(g.rotation[1:], components, strict=True)]
    codes = [c + d for c, d in zip(g.codes[:7], difference[7:], strict=True)]
    return PlainCodedGaussian(position, [(g.rotation[0] + j) % 4, *components], codes + g.codes[7:])


def _compute_morton_key(position: Vector, minimum: Vector) -> int:
    offsets = [p - o for p, o in zip(position, minimum, strict=True)]
    return sum((v >> b & 1) << (3 * b + 2 - a) for a, v in enumerate(offsets) for b in range(20))
