"""The worked examples of SPEC 2.3 and of Annex F: a Gaussian, the coder, the sampler, planes."""

from textwrap import fill

import numpy as np

from plain import coder as plain_coder
from plain import planes as plain_planes
from plain.planes import PlainSection, Run
from quarc_ref.decoder.anchors import count_anchors, sample_anchors
from quarc_ref.decoder.philox import philox
from quarc_ref.decoder.rotation import normalize_sums, rotate
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.planes import PlaneWriter
from quarc_ref.format.coding.values import code_fixed, code_signed, code_unsigned
from quarc_ref.format.constants import LATTICE_OFFSET
from quarc_ref.format.records import StreamHeader
from tests.spec import annex_pages
from tests.spec.annex_vectors import render_table


def overview() -> str:
    """One Gaussian in one frame (SPEC 2.3)."""
    header = StreamHeader(level_count=2, rotation_components=3)
    place, fine, coarse = (40, -12, 8), (1, 0, -2, 0, 0, 0), (0, 0, 1, 0, 0, 20)
    sums = [a + b for a, b in zip(fine, coarse, strict=True)]
    moved = tuple(p + header.translation_step * t for p, t in zip(place, sums, strict=False))
    unity = header.rotation_unity * header.level_count
    vector = np.array([[unity + 0], *([s] for s in sums[3:])], dtype=np.int64)
    residual = normalize_sums(vector)
    before = np.array([[1 << 22], [0], [0], [0]], dtype=np.int32)
    after = rotate(before, residual)
    rows = [
        ("position before", str(place)),
        ("rotation before", _tuple(before)),
        ("it follows", "anchor 3 of level 1 and anchor 1 of level 2"),
        ("symbols of anchor 3 of level 1", str(fine)),
        ("symbols of anchor 1 of level 2", str(coarse)),
        ("motion: the sums", str(tuple(sums))),
        ("position after: before + 7 T", str(moved)),
        ("(L x 100 + W', X, Y, Z)", _tuple(vector)),
        ("d: that, normalized with 20 guard bits", _tuple(residual)),
        ("rotation after: q x d / 2^22, normalized with 8 guard bits", _tuple(after)),
    ]
    return render_table(("what", "numbers"), rows)


def _tuple(column: np.ndarray) -> str:
    return str(tuple(column[:, 0].tolist()))


_BITS = (
    *((0, 4194304), (1, 256), (1, 256), (0, 1048576), (1, 256), (1, 4194304)),
    (1, 8388608),
)


def coder_steps() -> str:
    """The states of an encoder and of a decoder of the same bits (Annex F.6)."""
    total, state, words, rows = 1 << 24, 0, [], []
    for bit, weight in reversed(_BITS):
        share, left = (weight, total - weight) if bit else (total - weight, 0)
        before, written = state, ""
        if state >> 40 >= share:
            written = f"{state & 0xFFFFFFFF:08x}"
            words.append(written)
            state >>= 32
        state = (state // share << 24) + left + state % share
        rows.append((str(bit), str(weight), f"{before:016x}", written or "none", f"{state:016x}"))
    encoded = render_table(("bit", "weight", "state before", "word", "state after"), rows)
    while state:
        words.append(f"{state & 0xFFFFFFFF:08x}")
        state >>= 32
    coder, rows = plain_coder.PlainCoder([int(word, 16) for word in words]), []
    for bit, weight in _BITS:
        left, before = len(coder.words), coder.state
        taken = f"{coder.words[-1]:08x}" if coder.words else "none"
        assert coder.decode_bit(weight) == bit
        taken = taken if len(coder.words) < left else "none"
        rows.append((str(weight), f"{before:016x}", taken, str(bit), f"{coder.state:016x}"))
    decoded = render_table(("weight", "state before", "word", "bit", "state after"), rows)
    return (
        f"The encoder, from the last bit to the first:\n\n{encoded}\n"
        f"It then writes its state, low word first; the words are `{' '.join(words)}`. "
        f"The decoder:\n\n{decoded}"
    )


_POINTS = ((0, 0, 0), (1, 1, 0), (1, 1, 0), (9, 2, 4), (8, 2, 4), (-1, -1, -1), (-2, -1, -2))


def sampler() -> str:
    """Anchors of seven Gaussians (Annex F.7)."""
    header = StreamHeader(seed=7, level_count=1, gaussians_per_anchor=2)
    count, phase = len(_POINTS), 3
    ids = np.array([0, 1, 2, 4, 5, 8, 9])
    positions = np.array(_POINTS, dtype=np.int32).T
    blank = np.zeros((header.code_planes, count), dtype=np.int16)
    scene = Scene(header, 3, phase, ids, positions, np.zeros((4, count), dtype=np.int32), blank)
    anchors = sample_anchors(scene)
    wanted = count_anchors(count, header)[0]
    counter = np.stack([ids, np.full(count, phase), ids * 0, ids * 0 + 1]).astype(np.uint64)
    words = philox(counter, header.seed)[0].tolist()
    shift = next(s for s in range(25) if len(set(_cells(s))) <= wanted)
    cells = _cells(shift)
    owners = anchors.levels[0].owners.tolist()
    rows = []
    for i, place in enumerate(_POINTS):
        peers = [(words[j], int(ids[j])) for j in range(count) if cells[j] == cells[i]]
        best = min(peers) == (words[i], int(ids[i]))
        why = ("by rule 2" if best else "by rule 3") if ids[i] in owners else "no"
        followed = str(anchors.binding[0, i])
        rows.append((str(ids[i]), str(place), f"{words[i]:08x}", str(cells[i]), why, followed))
    head = ("id", "position", "word 0", f"cell at shift {shift}", "an anchor", "follows anchor")
    fewer = len(set(_cells(shift - 1)))
    return (
        f"With seed {header.seed}, phase {phase}, m = 2 and L = 1, A_1 = {wanted}. At shift "
        f"{shift - 1} the Gaussians occupy {fewer} cells, at shift {shift} {len(set(cells))}.\n\n"
        f"{render_table(head, rows)}\n"
        f"The anchors 0 to {wanted - 1} are the Gaussians {', '.join(map(str, owners))}.\n"
    )


def _cells(shift: int) -> list[tuple[int, ...]]:
    return [tuple((v + LATTICE_OFFSET) >> shift for v in point) for point in _POINTS]


_EXAMPLES = (
    ("Fixed(2)", (0, 0, 1, 0), (0, 3, 1, 2)),
    ("Unsigned(4)", (0, 0, 0, 0, 2), (0, 1, 5, 6, 200)),
    ("Signed(4)", (0, 0, 0, 1), (0, -1, -6, 3)),
    ("Ascending(6)", (0, 0, 0, 0), (3, 3, 10, 11)),
    ("Fixed(2)", (0,) * 19, (3,) * 18 + (2,)),
)


def planes() -> str:
    """Integers as planes (Annex F.8): written by the package, and read by the plain decoder."""
    parts, head = [], ("model and plane", "context", "weight", "bits")
    for form, contexts, values in _EXAMPLES:
        section = _write(form, contexts, values)
        plain = PlainSection("", section.words.tolist(), {})
        assert _read(plain, form, list(contexts)) == list(values)
        plain.close()
        rows = [_describe(run) for run in plain.runs]
        words = " ".join(f"{word:08x}" for word in section.words)
        title = (
            f"**{form}** of {_spaced(values)} in the outer contexts {_spaced(contexts)}; "
            f"words `{words}`:"
        )
        parts.append(f"{fill(title, 125)}\n\n{render_table(head, rows)}")
    return "\n".join(parts)


def _spaced(values: tuple[int, ...]) -> str:
    return ", ".join(map(str, values))


def _describe(run: Run) -> tuple[str, ...]:
    name = annex_pages.name_of(run)
    return name, annex_pages.context_of(run), annex_pages.weight_of(run), run.bits


def _write(form: str, contexts: tuple[int, ...], values: tuple[int, ...]):
    writer, width = PlaneWriter(ContextCounts()), int(form[-2])
    numbers = np.diff(values, prepend=0) if form[0] == "A" else np.array(values)
    code = {"F": code_fixed, "U": code_unsigned, "S": code_signed, "A": code_unsigned}[form[0]]
    code(writer, "n", np.array(contexts), width, numbers)
    return writer.section()


def _read(section: PlainSection, form: str, contexts: list[int]) -> list[int]:
    width = int(form[-2])
    if form[0] == "A":
        return plain_planes.ascending(section, "n", len(contexts), width)
    read = {"F": plain_planes.fixed, "U": plain_planes.unsigned, "S": plain_planes.signed}
    return read[form[0]](section, "n", contexts, width)
