"""Generates all files of the suite."""

import json
import struct
from collections.abc import Iterable
from dataclasses import replace
from hashlib import sha256

from making.container_faults import make_container_faults
from making.coverage import make_coverage_page
from making.damaged_streams import make_cut_vector, make_damaged_vectors
from making.encoder_scenes import make_scenes
from making.head_faults import make_head_faults
from making.level_faults import make_level_faults
from making.level_streams import make_large_payload_vectors, make_level_streams
from making.payload_faults import make_payload_faults
from making.payloads import Head
from making.recovery_traps import make_recovery_traps
from making.resource_streams import make_resource_vectors
from making.seek_streams import make_seek_faults
from making.snapshot_faults import make_snapshot_faults
from making.state_faults import make_motion_faults, make_state_faults, make_wrapping_rotation
from making.trap_streams import make_traps
from making.unit_answers import make_units
from making.update_faults import make_update_faults
from making.update_scenes import REQUIRED_CAPABILITY
from making.valid_streams import make_streams
from making.vectors import Outcome, ValidStream, Vector, make_patched_vector
from making.word_faults import make_wrapping_keys
from plain.state import PlainState

FORMAT_VERSION = "1.1"


def make_suite() -> dict[str, bytes]:
    """Return the content of every generated file, by its path in conformance/."""
    vectors, units = make_vectors(), make_units()
    names = [vector.name for vector in vectors]
    assert len(set(names)) == len(names)
    files = {vector.file_name: vector.data for vector in vectors if vector.is_stored}
    files |= {f"unit/{unit.function}.json": _pack_json(unit.as_json()) for unit in units}
    entries = [vector.as_json() for vector in vectors]
    unit_files = [f"unit/{unit.function}.json" for unit in units]
    manifest = {"format": FORMAT_VERSION, "vectors": entries, "units": unit_files}
    files["manifest.json"] = _pack_manifest(manifest)
    files |= {f"encoder/{name}.json": _pack_json(scene) for name, scene in make_scenes().items()}
    files["COVERAGE.md"] = make_coverage_page(vectors, units)
    return files


def make_vectors() -> list[Vector]:
    """Return all vectors; parents come before their patches."""
    streams, traps, levels = make_streams(), make_traps(), make_level_streams()
    streams_by_name = {
        valid_stream.vector.name: valid_stream for valid_stream in (*streams, *traps, *levels)
    }
    journey, brief = streams_by_name["streams/journey"], streams_by_name["streams/brief"]
    return [
        *(_add_number_digests(valid_stream) for valid_stream in streams_by_name.values()),
        *make_large_payload_vectors(levels),
        *make_container_faults(journey),
        *make_head_faults(brief),
        *make_level_faults(brief),
        *make_payload_faults(journey),
        *make_state_faults(journey),
        *make_motion_faults(streams_by_name["traps/lattice-extremes"]),
        *_make_frames_beyond_limits(streams_by_name),
        make_wrapping_keys(streams_by_name["streams/sh-rest"]),
        make_wrapping_rotation(streams_by_name["streams/least-fields"]),
        *make_damaged_vectors(journey),
        *_make_cut_vectors(brief),
        *make_recovery_traps(
            journey,
            streams_by_name["streams/canonical-after-canonical"],
            streams_by_name["streams/snapshots-journey"],
        ),
        *make_seek_faults(journey, streams_by_name["streams/canonical-after-canonical"]),
        *make_resource_vectors(
            journey, streams_by_name["levels/10-gaussians"], streams_by_name["levels/31"]
        ),
        *make_update_faults(
            streams_by_name["streams/updates-journey"],
            streams_by_name["streams/updates-far"],
            journey,
        ),
        *make_snapshot_faults(streams_by_name["streams/snapshots-journey"], journey),
    ]


def _make_cut_vectors(brief: ValidStream) -> Iterable[Vector]:
    """Yield `streams/brief` cut at every byte; these vectors are generated on demand."""
    for size in range(len(brief.layout.data)):
        name = f"damaged/cut-at-byte-{size:03}"
        yield replace(
            make_cut_vector(brief, size, name, f"the stream is cut after {size} bytes"),
            is_stored=False,
        )


def _make_frames_beyond_limits(streams_by_name: dict[str, ValidStream]) -> list[Vector]:
    """Return streams with a frame beyond the limits of its level or the largest ordinal."""
    from making.streams import Chunk

    last_ordinals, full_stream, updated_stream = (
        streams_by_name["streams/last-ordinals"],
        streams_by_name["levels/10-gaussians"],
        streams_by_name["levels/10-updates"],
    )
    next_frame = Chunk(b"FRAM", struct.pack("<IBIIII", 2, 0, 0, 0, 0, 0) + bytes(4))
    birth_frame = Chunk(b"FRAM", struct.pack("<IBIIII", 2, 0, 0, 1, 0, 0) + bytes(4))
    updated_frame = Chunk(b"FRAM", struct.pack("<IBIIIII", 2, 0, 0, 1, 0, 0, 0) + bytes(4))
    next_chunk_index = last_ordinals.stream.frame_chunk_indices[-1] + 1
    birth_chunk_index = full_stream.stream.frame_chunk_indices[-1] + 1
    return [
        make_patched_vector(
            last_ordinals,
            "invalid/ordinal-beyond",
            "7.4-2",
            last_ordinals.stream.insert_chunks(next_frame, index=next_chunk_index),
            Outcome(last_ordinals.frames, ("frame-order",)),
            "a frame after the frame with ordinal 2^32 - 1",
        ),
        make_patched_vector(
            full_stream,
            "invalid/birth-beyond-level",
            "3.2-2",
            full_stream.stream.insert_chunks(birth_frame, index=birth_chunk_index),
            Outcome(full_stream.frames, ("count-exceeds-level",)),
            "a birth although the level allows no more Gaussians",
        ),
        replace(
            make_patched_vector(
                updated_stream,
                "invalid/updates-birth-beyond-level",
                "3.2-2",
                updated_stream.stream.insert_chunks(updated_frame, index=birth_chunk_index),
                Outcome(updated_stream.frames, ("count-exceeds-level",)),
                "a birth although the level allows no more Gaussians and no update deletes one",
            ),
            **REQUIRED_CAPABILITY,
        ),
    ]


def _add_number_digests(valid_stream: ValidStream) -> Vector:
    """Return the vector of a stream, with digests of dequantized frames if the stream is small."""
    states = [state for state in valid_stream.stream.states if state is not None]
    if sum(len(state.gaussians) for state in states) > 500:
        return valid_stream.vector
    number_digests = tuple(
        (state.frame, _hash_dequantized_state(valid_stream.stream.head, state)) for state in states
    )
    return replace(valid_stream.vector, number_digests=number_digests)


def _hash_dequantized_state(head: Head, state: PlainState) -> str:
    """Return the SHA-256 of the dequantized state, whose numbers are binary32 (SPEC 10.1)."""
    steps = (
        [2.0**-head.lattice_exponent] * 3
        + [2.0**-22] * 4
        + [_round_to_binary32(head.log_scale_step)] * 3
    )
    steps += [_round_to_binary32(head.opacity_step)] + [_round_to_binary32(head.sh_dc_step)] * 3
    steps += [_round_to_binary32(head.sh_rest_step)] * 9
    columns = [(*g.position, *g.rotation, *g.codes) for g in state.gaussians]
    rows = zip(steps, zip(*columns, strict=True), strict=False)
    values = [step * value for step, row in rows for value in row]
    return sha256(struct.pack(f"<{len(values)}f", *values)).hexdigest()


def _round_to_binary32(step: float) -> float:
    """Return a step rounded to binary32, as HEAD stores it."""
    number: float = struct.unpack("<f", struct.pack("<f", step))[0]
    return number


def _pack_json(value: object) -> bytes:
    return (json.dumps(value, indent=1, ensure_ascii=False) + "\n").encode()


def _pack_manifest(manifest: dict[str, object]) -> bytes:
    """Return the manifest as JSON with one line for each vector, so that diffs are readable."""
    vectors = manifest["vectors"]
    assert isinstance(vectors, list)
    lines = ",\n".join(json.dumps(v, ensure_ascii=False, separators=(",", ":")) for v in vectors)
    units = json.dumps(manifest["units"])
    head = f'"format": "{manifest["format"]}",\n"units": {units},\n'
    return f'{{{head}"vectors": [\n{lines}\n]}}\n'.encode()
