"""SPEC 6 to 9 in plain Python integers: a second decoder, for the streams of the annexes.

It follows the wording of SPEC, shares only the slow functions of `plain.oracle`, and records
everything on the way: planes, symbols, anchors, states.
"""

import copy
import zlib
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from plain import gaussians, oracle
from plain.coder import Counts
from plain.fields import FieldReader, PlainChunk, Row
from plain.motion import read_motion
from plain.planes import PlainSection, Run, open_section, rows_in_contexts, rows_in_one_context
from plain.snapshots import add_differences, read_survivors, sort
from plain.state import PlainCoded, PlainGaussian, PlainLevel, PlainState, Vector
from plain.updates import apply_updates, read_updates

_CANONICAL_SECTIONS = ("positions", "SH DC", "opacity", "log-scales", "rotations", "SH rest")


@dataclass
class PlainFrame:
    """The content of a frame's chunk, and the resulting state."""

    kind: str
    state: PlainState
    runs: list[Run]
    notes: list[tuple[str, str]]
    state_crc: int


@dataclass
class PlainStream:
    rows: list[Row]
    chunks: list[PlainChunk]
    frames: list[PlainFrame]


def decode_plain(spec: str, data: bytes) -> PlainStream:
    """Decode a whole stream by the tables of SPEC; any fault is an AssertionError."""
    reader = FieldReader(spec, data)
    chunks = reader.chunks()
    header = chunks[0].fields
    frames: list[PlainFrame] = []
    for chunk in chunks:
        if chunk.kind in {"CANO", "SNAP", "FRAM"}:
            before = frames[-1].state if frames else None
            frames.append(FrameDecoder(header, chunk.fields).decode(before))
    return PlainStream(reader.rows, chunks, frames)


class FrameDecoder:
    """The chunk of one frame with parsed fields; `conformance` makes frames with the same walk."""

    def __init__(self, header: dict[str, Any], fields: dict[str, Any]) -> None:
        self.header, self.fields = header, fields
        self.runs: list[Run] = []
        self.notes: list[tuple[str, str]] = []
        self.has_rest = header["sh_degree"] == 1

    def decode(self, before: PlainState | None) -> PlainFrame:
        kind = "CANO" if "gaussian_count" in self.fields else "FRAM"
        kind = "SNAP" if "survivors" in self.fields else kind
        state = self.state_after(before)
        whole = state.phase % self.header["full_crc_interval"] == 0
        crc = zlib.crc32(state.serialize(codes=whole))
        assert crc == self.fields["state_crc"], "state-crc"
        return PlainFrame(kind, state, self.runs, self.notes, crc)

    def state_after(self, before: PlainState | None) -> PlainState:
        """The resulting state, even if its CRC is wrong."""
        if before is not None and "survivors" in self.fields:
            return self._snapshot(before)
        if before is None or "gaussian_count" in self.fields:
            return self._canonical()
        return self._follow(before)

    def _open(self, title: str, stored: Any, counts: Counts) -> PlainSection:
        return open_section(title, stored, counts)

    def _close(self, section: PlainSection) -> None:
        section.close()
        self.runs += section.runs

    def _note(self, name: str, value: object) -> None:
        self.notes.append((name, str(value)))

    def _canonical(self) -> PlainState:
        """SPEC 7.2."""
        coded = self._coded(self.fields["gaussian_count"])
        state = self._state_of(coded)
        if self.header["incompatible_features"] & 4:
            state.canonical = (state.frame, coded)
        return state

    def _snapshot(self, before: PlainState) -> PlainState:
        """SPEC 7.9."""
        assert before.canonical is not None, "chunk-order"
        assert self.fields["frame"] == before.frame + 1, "frame-order"
        frame, gaussians = before.canonical
        assert self.fields["canonical"] == frame, "frame-order"
        section = self._open("survivors", self.fields["survivors"], {})
        survivors = read_survivors(section, len(gaussians))
        self._close(section)
        for number, differences in survivors.items():
            self._note(f"differences of {number} of the CANO", differences)
        newborn = self._coded(self.fields["newborn_count"])
        assert survivors or newborn, "count"
        state = self._state_of(sort(add_differences(gaussians, survivors) + newborn))
        state.canonical = before.canonical
        return state

    def _coded(self, count: int) -> list[PlainCoded]:
        """SPEC 8.5."""
        stored = zip(_CANONICAL_SECTIONS, self.fields["sections"], strict=True)
        opened = [self._open(name, section, {}) for name, section in stored]
        keys = gaussians.read_keys(opened[0], "keys", count)
        assert max(keys, default=0) < 1 << (3 * self.fields["axis_bits"]), "symbol-range"
        dc = gaussians.read_colors(opened[1], "SH DC", count)
        opacity = rows_in_contexts(opened[2], "opacity", count, 1)
        scales = rows_in_contexts(opened[3], "log-scales", count, 3)
        rotations = gaussians.read_rotations(opened[4], "rotations", count)
        rest = gaussians.read_rest(opened[5], "SH rest", count) if self.has_rest else []
        for section in opened:
            self._close(section)
        self._note("rotations (j, a, b, c)", [(j, *abc) for j, abc in rotations])
        self._note("keys", keys)
        coded = []
        for i, key in enumerate(keys):
            offsets = [sum((key >> (3 * b + 2 - a) & 1) << b for b in range(20)) for a in range(3)]
            position = [o + v for o, v in zip(self.fields["origin"], offsets, strict=True)]
            j, abc = rotations[i]
            codes = [row[i] for row in scales + opacity + dc + rest]
            coded.append(PlainCoded(position, [j, *abc], codes))
        return coded

    def _state_of(self, coded: list[PlainCoded]) -> PlainState:
        """SPEC 7.2."""
        step, bits = self.header["position_step"], self.header["rotation_bits"]
        gaussians = []
        for i, g in enumerate(coded):
            rotation = self._expand(g.rotation, bits)
            assert max(map(abs, g.codes)) <= 32767, "code-range"
            motion = [0] * (3 + self.header["rotation_components"])
            position = [p * step for p in g.position]
            gaussians.append(PlainGaussian(i, position, rotation, list(g.codes), motion))
        return PlainState(self.fields["frame"], 0, len(coded), gaussians, [])

    def _expand(self, coded: Vector, bits: int) -> Vector:
        return oracle.expand_rotation(coded[0], coded[1:], bits)

    def _rotations(self, section: PlainSection, name: str, count: int) -> list[Vector]:
        coded = gaussians.read_rotations(section, name, count)
        self._note("rotations (j, a, b, c)", [(j, *abc) for j, abc in coded])
        bits = self.header["rotation_bits"]
        return [self._expand([j, *abc], bits) for j, abc in coded]

    def _follow(self, before: PlainState) -> PlainState:
        """SPEC 7.4 to 7.7."""
        assert self.fields["phase"] == before.phase + 1, "frame-order"
        before = copy.deepcopy(before)
        dying = sorted(before.gaussians, key=lambda g: (g.codes[3], g.id))
        dead = {g.id for g in dying[: self.fields["death_count"]]}
        left = [g for g in before.gaussians if g.id not in dead]
        self._note("ids of the dead", sorted(dead))
        state = replace(before, frame=before.frame + 1, phase=before.phase + 1, gaussians=left)
        sampled = before.phase % self.header["resample_interval"] == 0
        state.levels = self._sample(state) if sampled else self._bind_newborn(state)
        self._note("anchors are sampled", "yes" if sampled else "no")
        self._note_anchors(state)
        self._move(state)
        if self.header["incompatible_features"] & 2:
            self._update(state)
        self._append_births(state)
        return state

    def _note_anchors(self, state: PlainState) -> None:
        for number, level in enumerate(state.levels, 1):
            self._note(f"level {number}: ids of the anchors' Gaussians", level.owners)
            self._note(f"level {number}: positions of the anchors", level.positions)
            if number < len(state.levels):
                self._note(f"level {number}: parents of the anchors", level.parents)
            followed = [level.binding[g.id] for g in state.gaussians]
            self._note(f"level {number}: anchors that the Gaussians follow", followed)

    def _sample(self, state: PlainState) -> list[PlainLevel]:
        """SPEC 6."""
        ids = [g.id for g in state.gaussians]
        positions = [tuple(g.position) for g in state.gaussians]
        count = -(-len(ids) // self.header["gaussians_per_anchor"])
        levels = []
        for number in range(1, self.header["level_count"] + 1):
            chosen = oracle.sample(ids, positions, state.phase, self.header["seed"], number, count)
            anchors = [positions[i] for i in chosen]
            bound = oracle.bind(positions, anchors)
            binding = dict(zip(ids, bound, strict=True))
            owners = [ids[i] for i in chosen]
            levels.append(PlainLevel(owners, [list(p) for p in anchors], [], binding))
            count = max(1, count // self.header["anchor_ratio"])
        for level, above in pairwise(levels):
            level.parents = [above.binding[owner] for owner in level.owners]
        return levels

    def _bind_newborn(self, state: PlainState) -> list[PlainLevel]:
        for level in state.levels:
            for g in state.gaussians:
                if g.id not in level.binding:
                    anchors = [tuple(p) for p in level.positions]
                    level.binding[g.id] = oracle.bind([tuple(g.position)], anchors)[0]
        return state.levels

    def _move(self, state: PlainState) -> None:
        """SPEC 8.7 and 7.5."""
        previous = {g.id: g.motion for g in state.gaussians}
        if not self.fields["previous_contexts"]:
            previous = {}
        channels = 3 + self.header["rotation_components"]
        section = self._open("motion", self.fields["motion"], state.counts)
        read_motion(section, channels, previous, state.levels)
        self._close(section)
        for number, level in enumerate(state.levels, 1):
            self._note(f"level {number}: what is expected of the anchors", level.expected)
            self._note(f"level {number}: symbols of the anchors", level.symbols)
        step, unity = self.header["translation_step"], self.header["rotation_unity"]
        for g in state.gaussians:
            followed = [level.symbols[level.binding[g.id]] for level in state.levels]
            g.motion = [sum(channel) for channel in zip(*followed, strict=True)]
            moved = zip(g.position, g.motion[:3], strict=True)
            turn = [0] * (7 - len(g.motion)) + g.motion[3:]
            rotation = g.rotation
            if any(turn):
                turn[0] += len(state.levels) * unity
                rotation = oracle.turn(g.rotation, turn)
            g.position, g.rotation = [p + step * t for p, t in moved], rotation

    def _update(self, state: PlainState) -> None:
        """SPEC 8.8 and 7.8."""
        self._note("recency of the Gaussians", [g.recency for g in state.gaussians])
        section = self._open("updates", self.fields["updates"], state.counts)
        changes = read_updates(section, state.gaussians)
        self._close(section)
        for number, residuals in changes.items():
            self._note(f"update of {number}", "leaves" if residuals is None else residuals)
        step, unity = self.header["translation_step"], self.header["rotation_unity"]
        state.gaussians = apply_updates(state.gaussians, changes, step, unity)

    def _append_births(self, state: PlainState) -> None:
        """SPEC 8.6 and 7.6."""
        count, step = self.fields["birth_count"], self.header["position_step"]
        section = self._open("births", self.fields["births"], state.counts)
        parents = gaussians.read_keys(section, "births parents", count)
        position = rows_in_one_context(section, "births positions", count, 3)
        dc = gaussians.read_colors(section, "births SH DC", count)
        opacity = rows_in_one_context(section, "births opacity", count, 1)
        scales = gaussians.read_log_scales(section, "births log-scales", count)
        rotations = self._rotations(section, "births rotations", count)
        rest = []
        if self.has_rest:
            rest = gaussians.read_newborn_rest(section, "births SH rest", count)
        self._close(section)
        before = list(state.gaussians)
        for i, parent in enumerate(parents):
            assert parent < len(before), "parent-range"
            origin = before[parent].position
            codes = [row[i] for row in scales + opacity + dc + rest]
            assert max(map(abs, codes)) <= 32767, "code-range"
            residual = [row[i] for row in position]
            self._note(f"newborn {state.next_id}: parent", parent)
            self._note(f"newborn {state.next_id}: position residual", residual)
            place = [p + step * r for p, r in zip(origin, residual, strict=True)]
            motion = [0] * len(state.gaussians[0].motion)
            state.gaussians.append(
                PlainGaussian(state.next_id, place, rotations[i], codes, motion, 0)
            )
            state.next_id += 1
