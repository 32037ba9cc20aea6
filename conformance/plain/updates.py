"""Updates, SPEC 8.8 and 7.8, in plain Python integers, written from SPEC alone."""

from plain import oracle
from plain.planes import PlainSection, signed
from plain.state import PlainGaussian, Vector

_FIELDS = {
    "translation": range(3),
    "rotation": range(3, 6),
    "log-scales": range(6, 9),
    "opacity": range(9, 10),
    "SH DC": range(10, 13),
}

# By id: the residuals of a Gaussian that changes and stays, None if it leaves.
Changes = dict[int, Vector | None]


def read_updates(section: PlainSection, gaussians: list[PlainGaussian]) -> Changes:
    """The content of the section about the Gaussians."""
    contexts = [4 * _class(sum(map(abs, g.motion))) + g.recency for g in gaussians]
    bits = section.plane("updates, changes", "", contexts)
    chosen = [g for g, bit in zip(gaussians, bits, strict=True) if bit]
    dies = section.plane("updates, dies", "", [g.recency for g in chosen])
    changes: Changes = {
        g.id: None if bit else [0] * 13 for g, bit in zip(chosen, dies, strict=True)
    }
    left = [residuals for residuals in changes.values() if residuals is not None]
    answers = [0] * len(left)
    for number, name in enumerate(_FIELDS):
        bits = section.plane(f"updates, {name}", "", answers)
        answers = [a + (bit << number) for a, bit in zip(answers, bits, strict=True)]
    for number, rows in enumerate(_FIELDS.values()):
        there = [r for r, a in zip(left, answers, strict=True) if a >> number & 1]
        for row in rows:
            sums = [sum(residuals[rows.start : row]) for residuals in there]
            contexts = [3 * row + 1 + (s > 0) - (s < 0) for s in sums]
            values = signed(section, "updates, residuals", contexts, 4)
            for residuals, value in zip(there, values, strict=True):
                residuals[row] = value
    return changes


def apply_updates(
    gaussians: list[PlainGaussian], changes: Changes, step: int, unity: int
) -> list[PlainGaussian]:
    """The remaining Gaussians with their changes."""
    left = [g for g in gaussians if changes.get(g.id, []) is not None]
    assert left, "count"
    for g in left:
        g.recency = 0 if g.id in changes else min(g.recency + 1, 3)
        residuals = changes.get(g.id)
        if residuals:
            g.position = [p + step * r for p, r in zip(g.position, residuals[:3], strict=True)]
            assert max(map(abs, g.position)) < 1 << 23, "position-range"
            assert max(map(abs, residuals[3:6])) <= 256, "symbol-range"
            if any(residuals[3:6]):
                g.rotation = oracle.turn(g.rotation, [unity, *residuals[3:6]])
            g.codes[:7] = [c + r for c, r in zip(g.codes[:7], residuals[6:], strict=True)]
            assert max(map(abs, g.codes)) <= 32767, "code-range"
    return left


def _class(value: int) -> int:
    return (value > 0) + (value > 1) + (value > 3)
