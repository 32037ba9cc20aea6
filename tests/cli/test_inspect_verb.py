import re

import numpy as np
import pytest

from quarc_ref.decoder import compute_digest
from quarc_ref.format import container
from quarc_ref.format.records import StreamHeader
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.commands import run, run_json
from tests.small_streams import make_stream, rebuild_stream

_HEADER = StreamHeader(seed=7, resample_interval=2, gaussians_per_anchor=4, rotation_components=4)
_DATA, _STATES = make_stream(_HEADER, gaussian_count=40, frame_count=6, canonical_every=4)
_CHUNKS = list(split_chunks(_DATA))


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "some.quarc"
    path.write_bytes(_DATA)
    return path


def _parse_tables(text):
    """Parse printed tables; return the cells of all rows by the title of the table."""
    tables = {}
    for block in text.strip().split("\n\n"):
        title, _, *rows = block.splitlines()
        tables[title.strip()] = [re.split(r" {2,}", row.strip()) for row in rows]
    return tables


def test_every_chunk_is_listed_even_unknown_ones(tmp_path):
    chunks = [(chunk.kind, chunk.payload) for chunk in _CHUNKS[:-2]]
    tail = (_CHUNKS[-1].kind, _CHUNKS[-1].payload[:8] + bytes(8))
    data = rebuild_stream([*chunks, (b"nOte", b"hello"), tail])
    (tmp_path / "a.quarc").write_bytes(data)

    listed_chunks = run_json("inspect", tmp_path / "a.quarc")["chunks"]

    kinds = [*(chunk.kind.decode() for chunk in _CHUNKS[:-2]), "nOte", "TAIL"]
    assert [chunk["type"] for chunk in listed_chunks] == kinds
    assert [chunk["sequence"] for chunk in listed_chunks] == [*range(len(kinds))]
    assert listed_chunks[0]["offset"] == 8
    assert sum(chunk["bytes"] for chunk in listed_chunks) == len(data) - 8


def test_every_frame_has_its_figures(file):
    json_output = run_json("inspect", file)
    frames = json_output["per_frame"]

    assert [frame["frame"] for frame in frames] == [*range(6)]
    moved_kinds = ["moved"] * 3
    assert [frame["kind"] for frame in frames] == ["canonical", *moved_kinds, "canonical", "moved"]
    assert [frame["gaussians"] for frame in frames] == [state.scene.count for state in _STATES]
    assert [frame["sha256"] for frame in frames] == [
        compute_digest(state.scene) for state in _STATES
    ]
    sizes = [chunk.byte_count() for chunk in _CHUNKS if chunk.kind in {b"CANO", b"FRAM"}]
    assert [frame["bytes"]["chunk"] for frame in frames] == sizes
    for kind in ("canonical", "motion", "births"):
        assert sum(frame["bytes"][kind] for frame in frames) == json_output["bytes"][kind]
        estimate = sum(frame["estimate_bytes"][kind] for frame in frames)
        assert estimate == pytest.approx(json_output["estimate_bytes"][kind], abs=1)


def test_estimates_of_snapshots_and_updates_match_the_schema(tmp_path):
    header = StreamHeader(seed=3, updates=True, snapshots=True)
    data, _ = make_stream(header, 40, frame_count=6, snapshot_every=3)
    (tmp_path / "a.quarc").write_bytes(data)

    json_output = run_json("inspect", tmp_path / "a.quarc")

    for kind in ("snapshots", "updates"):
        sizes = [frame["estimate_bytes"][kind] for frame in json_output["per_frame"]]
        assert any(size % 1 for size in sizes)  # schemas allow more than integers


def test_the_symbols_are_those_of_the_stream_by_magnitude(file):
    json_output = run_json("inspect", file)

    symbols = np.concatenate([level for state in _STATES for level in state.symbols], axis=1)
    expected_counts = {
        "translation": [int((np.abs(symbols[:3]) == size).sum()) for size in range(4)],
        "rotation": [int((np.abs(symbols[3:]) == size).sum()) for size in range(4)],
    }
    assert json_output["symbols"] == expected_counts
    assert expected_counts["translation"][3] > 0
    sums = [sum(frame["symbols"]["rotation"]) for frame in json_output["per_frame"]]
    assert sum(sums) == symbols[3:].size
    assert sums[0] == sums[4] == 0


def test_the_same_figures_are_printed_as_text(file):
    json_output, tables = run_json("inspect", file), _parse_tables(run("inspect", file).stdout)

    assert [*tables] == ["some.quarc: chunks", "frames", "symbols", "bytes"]
    assert [row[0] for row in tables["some.quarc: chunks"]] == [
        chunk["type"] for chunk in json_output["chunks"]
    ]
    for row, frame in zip(tables["frames"], json_output["per_frame"], strict=True):
        counts = [frame[key] for key in ("gaussians", "births", "deaths", "updates")]
        counts.append(frame["bytes"]["chunk"])
        assert row[:7] == [f"{frame['frame']}", frame["kind"], *(f"{count:,}" for count in counts)]
        if frame["kind"] == "moved":
            for column, kind in ((7, "motion"), (9, "updates"), (11, "births")):
                assert row[column] == f"{frame['bytes'][kind]:,}"
    for size, row in enumerate(tables["symbols"]):
        for column, kind in ((1, "translation"), (3, "rotation")):
            counts = json_output["symbols"][kind]
            assert row[column : column + 2] == [
                f"{counts[size]:,}", f"{counts[size] / sum(counts):.2%}"
            ]  # fmt: skip
    cells_by_kind = {row[0]: row[1:] for row in tables["bytes"]}
    assert cells_by_kind["total"] == [f"{len(_DATA):,}"]
    ratio = json_output["bytes"]["motion"] / json_output["estimate_bytes"]["motion"]
    assert float(cells_by_kind["motion"][2]) == pytest.approx(ratio, abs=1e-3)


def test_figures_wider_than_the_terminal_are_not_truncated(file, monkeypatch):
    monkeypatch.setenv("COLUMNS", "30")

    text = run("inspect", file).stdout

    assert "…" not in text
    assert _parse_tables(text)["bytes"][-1] == ["total", f"{len(_DATA):,}"]


def test_a_stream_of_one_frame_has_no_symbols(tmp_path):
    (tmp_path / "a.quarc").write_bytes(make_stream(frame_count=1)[0])

    json_output = run_json("inspect", tmp_path / "a.quarc")
    assert json_output["symbols"] == {"translation": [], "rotation": []}
    assert run("inspect", tmp_path / "a.quarc").exit_code == 0


@pytest.mark.parametrize("kind", [container.CANO, container.FRAM])
def test_a_damaged_stream_is_rejected(kind, file):
    damaged_data = bytearray(_DATA)
    damaged_data[next(chunk.offset for chunk in _CHUNKS if chunk.kind == kind) + 40] ^= 1
    file.write_bytes(damaged_data)

    result = run("inspect", file)
    assert result.exit_code == 1
    assert result.stdout == ""
