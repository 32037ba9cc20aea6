"""Reads and applies updates (SPEC 7.8, 8.8) in plain integers; written from SPEC.md alone."""

from plain import oracle
from plain.planes import PlainSection, read_signed
from plain.state import PlainGaussian, Vector

_FIELD_RANGES = {
    "translation": range(3),
    "rotation": range(3, 6),
    "log-scales": range(6, 9),
    "opacity": range(9, 10),
    "SH DC": range(10, 13),
}

# The 13 residuals of each changed Gaussian, by its id; None if the Gaussian is deleted.
Changes = dict[int, Vector | None]


def read_updates(section: PlainSection, gaussians: list[PlainGaussian]) -> Changes:
    """Return the updates of a frame, read from its updates section."""
    contexts = [4 * _classify_motion(sum(map(abs, g.motion))) + g.recency for g in gaussians]
    bits = section.read_plane("updates, changes", "", contexts)
    changed = [g for g, bit in zip(gaussians, bits, strict=True) if bit]
    deletion_bits = section.read_plane("updates, dies", "", [g.recency for g in changed])
    changes: Changes = {
        g.id: None if bit else [0] * 13 for g, bit in zip(changed, deletion_bits, strict=True)
    }
    remaining = [residuals for residuals in changes.values() if residuals is not None]
    field_masks = [0] * len(remaining)
    for number, name in enumerate(_FIELD_RANGES):
        bits = section.read_plane(f"updates, {name}", "", field_masks)
        field_masks = [a + (bit << number) for a, bit in zip(field_masks, bits, strict=True)]
    for number, rows in enumerate(_FIELD_RANGES.values()):
        field_residuals = [
            r for r, a in zip(remaining, field_masks, strict=True) if a >> number & 1
        ]
        for row in rows:
            sums = [sum(residuals[rows.start : row]) for residuals in field_residuals]
            contexts = [3 * row + 1 + (s > 0) - (s < 0) for s in sums]
            values = read_signed(section, "updates, residuals", contexts, 4)
            for residuals, value in zip(field_residuals, values, strict=True):
                residuals[row] = value
    return changes


def apply_updates(
    gaussians: list[PlainGaussian], changes: Changes, step: int, unity: int
) -> list[PlainGaussian]:
    """Return the Gaussians that are not deleted, with their changes applied."""
    remaining = [g for g in gaussians if changes.get(g.id, []) is not None]
    assert remaining, "count"
    for g in remaining:
        g.recency = 0 if g.id in changes else min(g.recency + 1, 3)
        residuals = changes.get(g.id)
        if residuals:
            g.position = [p + step * r for p, r in zip(g.position, residuals[:3], strict=True)]
            assert max(map(abs, g.position)) < 1 << 23, "position-range"
            assert max(map(abs, residuals[3:6])) <= 256, "symbol-range"
            if any(residuals[3:6]):
                g.rotation = oracle.rotate(g.rotation, [unity, *residuals[3:6]])
            g.codes[:7] = [c + r for c, r in zip(g.codes[:7], residuals[6:], strict=True)]
            assert max(map(abs, g.codes)) <= 32767, "code-range"
    return remaining


def _classify_motion(value: int) -> int:
    return (value > 0) + (value > 1) + (value > 3)
