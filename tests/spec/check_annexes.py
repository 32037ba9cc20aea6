"""Checks of the annexes of a text: known answers, widths, and the four streams."""

import re

from plain import spec_text
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.scene import Scene
from quarc_ref.streams import decode
from tests.spec import annex_widths
from tests.spec.annex_vectors import numbers
from tests.spec.make_annexes import make_regions, streams
from tests.spec.vector_tables import TABLES

# Random123's file of known answers: philox4x32, 10 rounds.
_RANDOM123 = [
    [*["00000000 " * 4], *["00000000 " * 2], "6627e8d5 e169c58d bc57ac4c 9b00dbd8"],
    [*["ffffffff " * 4], *["ffffffff " * 2], "408f276d 41c83b0e a20bc7c6 6d5451fd"],
    [
        "243f6a88 85a308d3 13198a2e 03707344",
        "a4093822 299f31d0",
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ],
]
_REGIONS: dict[str, str] = {}


def compute_regions() -> dict[str, str]:
    """Return the output of `make_annexes` for the current text, computed once."""
    if not _REGIONS:
        _REGIONS.update(make_regions(spec_text.read_spec()))
    return _REGIONS


def check_regions(spec: str) -> None:
    """Check that the generated regions equal the current output of `make_annexes`."""
    regions = compute_regions()
    found = re.findall(r"<!-- made:(\S+) -->\n(.*?)<!-- end:(\S+) -->", spec, re.DOTALL)
    assert sorted(name for name, *_ in found) == sorted(regions)
    assert spec.count("<!-- made:") == spec.count("<!-- end:") == len(found)
    for name, body, end_name in found:
        assert (end_name, body) == (name, regions[name]), f"{name}: make_annexes.py makes it anew"


def check_vectors(spec: str) -> None:
    for table in TABLES:
        rows = spec_text.read_table(spec, f"vectors {table.marker}")
        assert len(rows) == len(table.inputs)
        for *cells, answer in rows:
            assert table.package(*cells) == table.independent(*cells) == answer, (
                table.marker,
                cells,
            )


def check_random123(spec: str) -> None:
    rows = spec_text.read_table(spec, "vectors philox")
    expected_rows = [[cell.strip() for cell in row] for row in _RANDOM123]
    assert rows[: len(expected_rows)] == expected_rows


def check_widths(spec: str) -> None:
    sections = spec_text.list_section_numbers(spec)
    for name, minimum, maximum, bits, section in spec_text.read_table(spec, "widths"):
        assert bits == annex_widths.bit_width(int(minimum), int(maximum)), name
        assert section in sections, name
        assert int(bits[1:]) <= 64, name


def check_dump(name: str, data: bytes) -> None:
    """Check that a dump has the bytes of its stream."""
    assert data == streams()[name]


def check_offsets(spec: str) -> None:
    """Check that the rows of the fields contain the bytes of the dumps."""
    for name in streams():
        dump, offset = spec_text.read_dump(name), 0
        for row in spec_text.read_records(spec, f"fields {name}"):
            assert int(row["offset"], 16) == offset, row
            row_bytes = bytes.fromhex(row["bytes"].replace("none", ""))
            assert dump[offset : offset + len(row_bytes)] == row_bytes, row
            offset += len(row_bytes)
        assert offset == len(dump), name


def check_states(spec: str) -> None:
    """Check that the package decodes the dumps to the digests and states in the text."""
    for name in streams():
        scenes = list(decode(spec_text.read_dump(name)))
        rows = spec_text.read_records(spec, f"digests {name}")
        for scene, row in zip(scenes, rows, strict=True):
            assert compute_digest(scene) == row["SHA-256 of the serialization"].strip("`")
            assert (scene.frame, scene.phase, scene.count) == (
                int(row["frame"]),
                int(row["phase"]),
                int(row["N"]),
            )
            state_rows = spec_text.read_table(spec, f"state {name}{scene.frame}")
            assert [[numbers(cell) for cell in cells] for cells in state_rows] == _columns(scene)


def _columns(scene: Scene) -> list[list[list[int]]]:
    fields = (scene.ids[None], scene.positions, scene.rotations, scene.codes)
    return [[field[:, i].tolist() for field in fields] for i in range(scene.count)]


CHECKS = (
    check_regions,
    check_vectors,
    check_random123,
    check_widths,
    check_offsets,
    check_states,
)
