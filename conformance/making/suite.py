"""The whole suite as files by name."""

import json
import struct
from collections.abc import Iterable
from dataclasses import replace
from hashlib import sha256

from making.container_faults import make_container_faults
from making.coverage import write_coverage
from making.damaged_streams import make_cut, make_damaged
from making.encoder_scenes import make_scenes
from making.head_faults import make_head_faults
from making.level_streams import make_larger, make_levels
from making.payload_faults import make_payload_faults
from making.payloads import Head
from making.resource_streams import make_resources
from making.seek_streams import make_seeks
from making.snapshot_faults import make_snapshot_faults
from making.state_faults import make_motion_faults, make_state_faults
from making.trap_streams import make_traps
from making.unit_answers import make_units
from making.update_faults import make_update_faults
from making.valid_streams import make_streams
from making.vectors import Outcome, Valid, Vector, broken
from plain.state import PlainState

FORMAT = "1.1"


def make_suite() -> dict[str, bytes]:
    """Return every generated file of the suite."""
    vectors, units = make_vectors(), make_units()
    names = [vector.name for vector in vectors]
    assert len(set(names)) == len(names)
    files = {vector.file: vector.data for vector in vectors if vector.stored}
    files |= {f"unit/{unit.function}.json": _lines(unit.as_json()) for unit in units}
    entries = [vector.as_json() for vector in vectors]
    units_named = [f"unit/{unit.function}.json" for unit in units]
    manifest = {"format": FORMAT, "vectors": entries, "units": units_named}
    files["manifest.json"] = _manifest(manifest)
    files |= {f"encoder/{name}.json": _lines(scene) for name, scene in make_scenes().items()}
    files["COVERAGE.md"] = write_coverage(vectors, units)
    return files


def make_vectors() -> list[Vector]:
    """Return all vectors; parents come before their patches."""
    streams, traps, levels = make_streams(), make_traps(), make_levels()
    known = {each.vector.name: each for each in (*streams, *traps, *levels)}
    journey, brief = known["streams/journey"], known["streams/brief"]
    return [
        *(_with_numbers(each) for each in known.values()),
        *make_larger(levels),
        *make_container_faults(journey),
        *make_head_faults(brief),
        *make_payload_faults(journey),
        *make_state_faults(journey),
        *make_motion_faults(known["traps/lattice-extremes"]),
        *_beyond(known),
        *make_damaged(journey),
        *_cuts(brief),
        *make_seeks(journey),
        *make_resources(journey, known["levels/10-gaussians"], known["levels/31"]),
        *make_update_faults(
            known["streams/updates-journey"], known["streams/updates-far"], journey
        ),
        *make_snapshot_faults(known["streams/snapshots-journey"], journey),
    ]


def _cuts(brief: Valid) -> Iterable[Vector]:
    """The brief stream, cut at every byte; generated on demand."""
    for size in range(len(brief.layout.data)):
        name = f"damaged/cut-at-byte-{size:03}"
        yield replace(make_cut(brief, size, name, f"the first {size} bytes"), stored=False)


def _beyond(known: dict[str, Valid]) -> list[Vector]:
    """Frames beyond the limits of a level or a counter."""
    from making.streams import Piece

    late, full = known["streams/last-ordinals"], known["levels/10-gaussians"]
    after = Piece(b"FRAM", struct.pack("<IBIIII", 2, 0, 0, 0, 0, 0) + bytes(4))
    more = Piece(b"FRAM", struct.pack("<IBIIII", 2, 0, 0, 1, 0, 0) + bytes(4))
    place = late.stream.places[-1] + 1
    grown = full.stream.places[-1] + 1
    return [
        broken(
            late,
            "invalid/ordinal-beyond",
            "7.4-2",
            late.stream.before(after, place=place),
            Outcome(late.frames, ("frame-order",)),
            "a frame after that of ordinal 2^32 - 1",
        ),
        broken(
            full,
            "invalid/birth-beyond-level",
            "3.2-2",
            full.stream.before(more, place=grown),
            Outcome(full.frames, ("count-exceeds-level",)),
            "a birth although the level allows no more Gaussians",
        ),
    ]


def _with_numbers(each: Valid) -> Vector:
    """The vector, with the dequantized numbers of its frames if they are few."""
    states = [state for state in each.stream.states if state is not None]
    if sum(len(state.gaussians) for state in states) > 500:
        return each.vector
    numbers = tuple((state.frame, _numbers(each.stream.head, state)) for state in states)
    return replace(each.vector, numbers=numbers)


def _numbers(head: Head, state: PlainState) -> str:
    """SHA-256 of the numbers of SPEC 10.1 as binary32, row by row as in a serialization."""
    steps = [2.0**-head.lattice_exponent] * 3 + [2.0**-22] * 4 + [_stored(head.log_scale_step)] * 3
    steps += [_stored(head.opacity_step)] + [_stored(head.sh_dc_step)] * 3
    steps += [_stored(head.sh_rest_step)] * 9
    columns = [(*g.position, *g.rotation, *g.codes) for g in state.gaussians]
    rows = zip(steps, zip(*columns, strict=True), strict=False)
    values = [step * value for step, row in rows for value in row]
    return sha256(struct.pack(f"<{len(values)}f", *values)).hexdigest()


def _stored(step: float) -> float:
    """The binary32 in HEAD; its product with 16 bits is exact in a double."""
    number: float = struct.unpack("<f", struct.pack("<f", step))[0]
    return number


def _lines(value: object) -> bytes:
    return (json.dumps(value, indent=1, ensure_ascii=False) + "\n").encode()


def _manifest(manifest: dict[str, object]) -> bytes:
    """The manifest, with a line for each vector, so that differences are easy to read."""
    vectors = manifest["vectors"]
    assert isinstance(vectors, list)
    lines = ",\n".join(json.dumps(v, ensure_ascii=False, separators=(",", ":")) for v in vectors)
    units = json.dumps(manifest["units"])
    head = f'"format": "{manifest["format"]}",\n"units": {units},\n'
    return f'{{{head}"vectors": [\n{lines}\n]}}\n'.encode()
