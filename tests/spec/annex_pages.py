"""The pages of Annex G: a stream field by field, plane by plane, state by state."""

import hashlib
from itertools import groupby

from plain.decoder import PlainFrame, PlainStream
from plain.planes import Run
from tests.spec.annex_vectors import render_table

_HALF = str(1 << 23)


def dump(data: bytes) -> str:
    """Return the hex dump of bytes, which `xxd -r` converts back."""
    lines = [
        f"{offset:08x}: {data[offset : offset + 16].hex(' ')}" for offset in range(0, len(data), 16)
    ]
    return "\n".join([*lines, ""])


def introduction(data: bytes, path: str) -> str:
    """Return a paragraph with the size and the digest of a stream, and a link to its dump."""
    digest = hashlib.sha256(data).hexdigest()
    name = path.rpartition("/")[2]
    return (
        f"The stream has {len(data)} bytes, which are dumped in [{name}]({path}); "
        f"their SHA-256 is\n`{digest}`.\n"
    )


def fields(stream: PlainStream, marker: str) -> str:
    rows = [
        (f"{row.offset:04x}", row.data.hex(" ") or "none", row.field, row.value)
        for row in stream.rows
    ]
    table = render_table(("offset", "bytes", "field", "value"), rows)
    return f"<!-- spec:fields {marker} -->\n{table}"


def planes(frame: PlainFrame, marker: str) -> str:
    """Return the table of a frame's planes in coding order, with contexts, weights and bits."""
    rows = []
    for (section, plane), runs in groupby(
        frame.runs, key=lambda run: (run.section, plane_name(run))
    ):
        cells = [(context_cell(run), weight_cell(run), run.bits) for run in runs]
        contexts, weights, bits = (" ".join(column) for column in zip(*cells, strict=True))
        rows.append((section, plane, contexts, weights.replace(_HALF, "half"), bits))
    table = render_table(("section", "model and plane", "contexts", "weights", "bits"), rows)
    return f"<!-- spec:planes {marker} -->\n{table}"


def plane_name(run: Run) -> str:
    """Return the model of a run, and the index of the plane."""
    return ": ".join(filter(None, (run.model, run.plane)))


def context_cell(run: Run) -> str:
    return "raw" if run.context is None else str(run.context)


def weight_cell(run: Run) -> str:
    """Return the stated code of a run, or its weight if no code is stated."""
    return str(run.weight) if run.code is None else f"code {run.code}"


def notes(frame: PlainFrame, marker: str) -> str:
    rows = [(name, _without_brackets(value)) for name, value in frame.notes]
    return f"<!-- spec:notes {marker} -->\n" + render_table(("what", "numbers"), rows)


def _without_brackets(value: str) -> str:
    if value.startswith("[["):
        return value[1:-1].replace("[", "(").replace("]", ")")
    return value.removeprefix("[").removesuffix("]") or "none"


def states(frame: PlainFrame, marker: str) -> str:
    rows = [
        (str(g.id), _join_values(g.position), _join_values(g.rotation), _join_values(g.codes))
        for g in frame.state.gaussians
    ]
    table = render_table(("id", "position", "rotation", "codes"), rows)
    return f"<!-- spec:state {marker} -->\n{table}"


def _join_values(values: list[int]) -> str:
    return ", ".join(map(str, values))


def digests(stream: PlainStream, marker: str) -> str:
    rows = []
    for frame in stream.frames:
        state = frame.state
        serialized = state.serialize()
        numbers = (state.frame, state.phase, len(state.gaussians), len(serialized))
        crc = f"{frame.state_crc:08x}"
        rows.append((*map(str, numbers), crc, f"`{state.compute_digest()}`"))
    head = ("frame", "phase", "N", "bytes serialized", "state_crc", "SHA-256 of the serialization")
    return f"<!-- spec:digests {marker} -->\n" + render_table(head, rows)
