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
    position, fine_symbols, coarse_symbols = (40, -12, 8), (1, 0, -2, 0, 0, 0), (0, 0, 1, 0, 0, 20)
    sums = [a + b for a, b in zip(fine_symbols, coarse_symbols, strict=True)]
    moved_position = tuple(
        p + header.translation_step * t for p, t in zip(position, sums, strict=False)
    )
    unity = header.rotation_unity * header.level_count
    vector = np.array([[unity + 0], *([s] for s in sums[3:])], dtype=np.int64)
    residual = normalize_sums(vector)
    rotation_before = np.array([[1 << 22], [0], [0], [0]], dtype=np.int32)
    rotation_after = rotate(rotation_before, residual)
    rows = [
        ("position before", str(position)),
        ("rotation before", _tuple(rotation_before)),
        ("anchors that it follows", "anchor 3 of level 1 and anchor 1 of level 2"),
        ("symbols of anchor 3 of level 1", str(fine_symbols)),
        ("symbols of anchor 1 of level 2", str(coarse_symbols)),
        ("motion: the sums of the symbols", str(tuple(sums))),
        ("position after: before + 7 T", str(moved_position)),
        ("(L x 100 + W', X, Y, Z)", _tuple(vector)),
        ("d: this vector, normalized with 20 guard bits", _tuple(residual)),
        ("rotation after: q x d / 2^22, normalized with 8 guard bits", _tuple(rotation_after)),
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
        bit_weight, bit_start = (weight, total - weight) if bit else (total - weight, 0)
        state_before, written_word = state, ""
        if state >> 40 >= bit_weight:
            written_word = f"{state & 0xFFFFFFFF:08x}"
            words.append(written_word)
            state >>= 32
        state = (state // bit_weight << 24) + bit_start + state % bit_weight
        rows.append(
            (str(bit), str(weight), f"{state_before:016x}", written_word or "none", f"{state:016x}")
        )
    encoded = render_table(("bit", "weight", "state before", "word", "state after"), rows)
    while state:
        words.append(f"{state & 0xFFFFFFFF:08x}")
        state >>= 32
    coder, rows = plain_coder.PlainBitDecoder([int(word, 16) for word in words]), []
    for bit, weight in _BITS:
        word_count, state_before = len(coder.words), coder.state
        taken_word = f"{coder.words[-1]:08x}" if coder.words else "none"
        assert coder.decode_bit(weight) == bit
        taken_word = taken_word if len(coder.words) < word_count else "none"
        rows.append(
            (str(weight), f"{state_before:016x}", taken_word, str(bit), f"{coder.state:016x}")
        )
    decoded = render_table(("weight", "state before", "word", "bit", "state after"), rows)
    return (
        f"The encoder codes the bits from the last to the first:\n\n{encoded}\n"
        f"It then writes its state, low word first; the words are `{' '.join(words)}`. "
        f"The decoder takes the words\nfrom the last to the first:\n\n{decoded}"
    )


_POINTS = ((0, 0, 0), (1, 1, 0), (1, 1, 0), (9, 2, 4), (8, 2, 4), (-1, -1, -1), (-2, -1, -2))


def sampler() -> str:
    """Anchors of seven Gaussians (Annex F.7)."""
    header = StreamHeader(seed=7, level_count=1, gaussians_per_anchor=2)
    count, phase = len(_POINTS), 3
    ids = np.array([0, 1, 2, 4, 5, 8, 9])
    positions = np.array(_POINTS, dtype=np.int32).T
    codes = np.zeros((header.code_planes, count), dtype=np.int16)
    scene = Scene(header, 3, phase, ids, positions, np.zeros((4, count), dtype=np.int32), codes)
    anchors = sample_anchors(scene)
    anchor_count = count_anchors(count, header)[0]
    counter = np.stack([ids, np.full(count, phase), ids * 0, ids * 0 + 1]).astype(np.uint64)
    words = philox(counter, header.seed)[0].tolist()
    shift = next(s for s in range(25) if len(set(_list_cells(s))) <= anchor_count)
    cells = _list_cells(shift)
    owners = anchors.levels[0].owners.tolist()
    rows = []
    for i, point in enumerate(_POINTS):
        cell_ranks = [(words[j], int(ids[j])) for j in range(count) if cells[j] == cells[i]]
        is_lowest = min(cell_ranks) == (words[i], int(ids[i]))
        role = ("by rule 2" if is_lowest else "by rule 3") if ids[i] in owners else "no"
        anchor = str(anchors.binding[0, i])
        rows.append((str(ids[i]), str(point), f"{words[i]:08x}", str(cells[i]), role, anchor))
    head = (
        "id",
        "position",
        "word 0",
        f"cell at shift {shift}",
        "chosen as an anchor",
        "follows anchor",
    )
    occupied = len(set(_list_cells(shift - 1)))
    return (
        f"With seed {header.seed}, phase {phase}, m = 2 and L = 1, the Gaussians of the table have "
        f"A_1 = {anchor_count} anchors. At shift\n{shift - 1}, the Gaussians occupy "
        f"{occupied} cells; "
        f"at shift {shift}, they occupy {len(set(cells))}.\n\n"
        f"{render_table(head, rows)}\n"
        f"The anchors 0 to {anchor_count - 1} are the Gaussians with the ids "
        f"{', '.join(map(str, owners))}.\n"
    )


def _list_cells(shift: int) -> list[tuple[int, ...]]:
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
        plain_section = PlainSection("", section.words.tolist(), {})
        assert _read(plain_section, form, list(contexts)) == list(values)
        plain_section.close()
        rows = [_describe(run) for run in plain_section.runs]
        words = " ".join(f"{word:08x}" for word in section.words)
        title = (
            f"**{form}** of {_join_values(values)} in the outer contexts {_join_values(contexts)}; "
            f"words `{words}`:"
        )
        parts.append(f"{fill(title, 125)}\n\n{render_table(head, rows)}")
    return "\n".join(parts)


def _join_values(values: tuple[int, ...]) -> str:
    return ", ".join(map(str, values))


def _describe(run: Run) -> tuple[str, ...]:
    name = annex_pages.plane_name(run)
    return name, annex_pages.context_cell(run), annex_pages.weight_cell(run), run.bits


def _write(form: str, contexts: tuple[int, ...], values: tuple[int, ...]):
    writer, width = PlaneWriter(ContextCounts()), int(form[-2])
    numbers = np.diff(values, prepend=0) if form[0] == "A" else np.array(values)
    code = {"F": code_fixed, "U": code_unsigned, "S": code_signed, "A": code_unsigned}[form[0]]
    code(writer, "n", np.array(contexts), width, numbers)
    return writer.section()


def _read(section: PlainSection, form: str, contexts: list[int]) -> list[int]:
    width = int(form[-2])
    if form[0] == "A":
        return plain_planes.read_ascending(section, "n", len(contexts), width)
    readers = {
        "F": plain_planes.read_fixed,
        "U": plain_planes.read_unsigned,
        "S": plain_planes.read_signed,
    }
    return readers[form[0]](section, "n", contexts, width)
