"""A second decoder in plain Python integers (SPEC 6 to 9), for the vectors and the annexes.

It follows the wording of SPEC.md, and records all intermediate results: planes, symbols, anchors
and states.
"""

import copy
import zlib
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any

from plain import gaussians, oracle
from plain.coder import Counts
from plain.fields import FieldReader, FieldRow, PlainChunk
from plain.motion import read_motion
from plain.planes import (
    PlainSection,
    Run,
    open_section,
    read_rows_by_context,
    read_rows_in_one_context,
)
from plain.snapshots import add_differences, read_survivors, sort_by_morton_key
from plain.state import PlainCodedGaussian, PlainGaussian, PlainLevel, PlainState, Vector
from plain.updates import apply_updates, read_updates

_CANONICAL_SECTIONS = ("positions", "SH DC", "opacity", "log-scales", "rotations", "SH rest")


@dataclass
class PlainFrame:
    """The content of a frame's chunk, and the state after the frame."""

    kind: str
    state: PlainState
    runs: list[Run]
    notes: list[tuple[str, str]]
    state_crc: int


@dataclass
class PlainStream:
    rows: list[FieldRow]
    chunks: list[PlainChunk]
    frames: list[PlainFrame]


def decode_plain(spec: str, data: bytes) -> PlainStream:
    """Decode a stream with the syntax tables of SPEC.md; raise an AssertionError for any fault."""
    reader = FieldReader(spec, data)
    chunks = reader.read_chunks()
    header = chunks[0].fields
    frames: list[PlainFrame] = []
    for chunk in chunks:
        if chunk.kind in {"CANO", "SNAP", "FRAM"}:
            previous = frames[-1].state if frames else None
            frames.append(FrameDecoder(header, chunk.fields).decode(previous))
    return PlainStream(reader.rows, chunks, frames)


class FrameDecoder:
    """Decodes one frame from its parsed fields; `making.frames` has a subclass that encodes it."""

    def __init__(self, header: dict[str, Any], fields: dict[str, Any]) -> None:
        self.header, self.fields = header, fields
        self.runs: list[Run] = []
        self.notes: list[tuple[str, str]] = []
        self.has_sh_rest = header["sh_degree"] == 1

    def decode(self, previous: PlainState | None) -> PlainFrame:
        kind = "CANO" if "gaussian_count" in self.fields else "FRAM"
        kind = "SNAP" if "survivors" in self.fields else kind
        state = self.reconstruct_state(previous)
        covers_codes = state.phase % self.header["full_crc_interval"] == 0
        crc = zlib.crc32(state.serialize(codes=covers_codes))
        assert crc == self.fields["state_crc"], "state-crc"
        return PlainFrame(kind, state, self.runs, self.notes, crc)

    def reconstruct_state(self, previous: PlainState | None) -> PlainState:
        """Return the state after the frame, without checking its CRC."""
        if previous is not None and "survivors" in self.fields:
            return self._decode_snapshot(previous)
        if previous is None or "gaussian_count" in self.fields:
            return self._decode_canonical()
        return self._decode_frame(previous)

    def _open_section(self, title: str, stored: Any, counts: Counts) -> PlainSection:
        return open_section(title, stored, counts)

    def _close_section(self, section: PlainSection) -> None:
        section.close()
        self.runs += section.runs

    def _record_note(self, name: str, value: object) -> None:
        self.notes.append((name, str(value)))

    def _decode_canonical(self) -> PlainState:
        """Return the state after a CANO chunk (SPEC 7.2)."""
        coded_gaussians = self._read_gaussians(self.fields["gaussian_count"])
        state = self._make_state(coded_gaussians)
        if self.header["incompatible_features"] & 4:
            state.canonical = (state.frame, coded_gaussians)
        return state

    def _decode_snapshot(self, previous: PlainState) -> PlainState:
        """Return the state after a SNAP chunk (SPEC 7.9)."""
        assert previous.canonical is not None, "chunk-order"
        assert self.fields["frame"] == previous.frame + 1, "frame-order"
        canonical_frame, canonical_gaussians = previous.canonical
        assert self.fields["canonical"] == canonical_frame, "frame-order"
        section = self._open_section("survivors", self.fields["survivors"], {})
        survivors = read_survivors(section, len(canonical_gaussians))
        self._close_section(section)
        for number, differences in survivors.items():
            self._record_note(f"differences of Gaussian {number} of the CANO", differences)
        newborn_gaussians = self._read_gaussians(self.fields["newborn_count"])
        assert survivors or newborn_gaussians, "count"
        state = self._make_state(
            sort_by_morton_key(add_differences(canonical_gaussians, survivors) + newborn_gaussians)
        )
        state.canonical = previous.canonical
        return state

    def _read_gaussians(self, count: int) -> list[PlainCodedGaussian]:
        """Read the Gaussians of a canonical frame or the new Gaussians of a snapshot (SPEC 8.5)."""
        named_sections = zip(_CANONICAL_SECTIONS, self.fields["sections"], strict=True)
        sections = [self._open_section(name, section, {}) for name, section in named_sections]
        keys = gaussians.read_keys(sections[0], "keys", count)
        assert max(keys, default=0) < 1 << (3 * self.fields["axis_bits"]), "symbol-range"
        sh_dc = gaussians.read_colors(sections[1], "SH DC", count)
        opacity = read_rows_by_context(sections[2], "opacity", count, 1)
        scales = read_rows_by_context(sections[3], "log-scales", count, 3)
        rotations = gaussians.read_rotations(sections[4], "rotations", count)
        sh_rest = gaussians.read_sh_rest(sections[5], "SH rest", count) if self.has_sh_rest else []
        for section in sections:
            self._close_section(section)
        self._record_note(
            "rotations (j, a, b, c)", [(j, *components) for j, components in rotations]
        )
        self._record_note("keys", keys)
        coded = []
        for i, key in enumerate(keys):
            position = [o + v for o, v in zip(self.fields["origin"], _split_key(key), strict=True)]
            j, components = rotations[i]
            codes = [row[i] for row in scales + opacity + sh_dc + sh_rest]
            coded.append(PlainCodedGaussian(position, [j, *components], codes))
        return coded

    def _make_state(self, coded_gaussians: list[PlainCodedGaussian]) -> PlainState:
        """Return the state at the start of a segment, from coded Gaussians (SPEC 7.2)."""
        step, bits = self.header["position_step"], self.header["rotation_bits"]
        gaussians = []
        for i, g in enumerate(coded_gaussians):
            rotation = self._expand_rotation(g.rotation, bits)
            assert max(map(abs, g.codes)) <= 32767, "code-range"
            motion = [0] * (3 + self.header["rotation_components"])
            position = [p * step for p in g.position]
            gaussians.append(PlainGaussian(i, position, rotation, list(g.codes), motion))
        return PlainState(self.fields["frame"], 0, len(coded_gaussians), gaussians, [])

    def _expand_rotation(self, coded: Vector, bits: int) -> Vector:
        return oracle.expand_rotation(coded[0], coded[1:], bits)

    def _read_rotations(self, section: PlainSection, name: str, count: int) -> list[Vector]:
        coded = gaussians.read_rotations(section, name, count)
        self._record_note("rotations (j, a, b, c)", [(j, *components) for j, components in coded])
        bits = self.header["rotation_bits"]
        return [self._expand_rotation([j, *components], bits) for j, components in coded]

    def _decode_frame(self, previous: PlainState) -> PlainState:
        """Return the state after a FRAM chunk (SPEC 7.4 to 7.8)."""
        assert self.fields["phase"] == previous.phase + 1, "frame-order"
        previous = copy.deepcopy(previous)
        gaussians_by_opacity = sorted(previous.gaussians, key=lambda g: (g.codes[3], g.id))
        dead_ids = {g.id for g in gaussians_by_opacity[: self.fields["death_count"]]}
        remaining = [g for g in previous.gaussians if g.id not in dead_ids]
        self._record_note("ids of the Gaussians that die", sorted(dead_ids))
        state = replace(
            previous, frame=previous.frame + 1, phase=previous.phase + 1, gaussians=remaining
        )
        is_sampling = previous.phase % self.header["resample_interval"] == 0
        state.levels = self._sample_anchors(state) if is_sampling else self._bind_newborn(state)
        self._record_note("anchors are sampled", "yes" if is_sampling else "no")
        self._record_anchors(state)
        self._apply_motion(state)
        if self.header["incompatible_features"] & 2:
            self._apply_updates(state)
        self._append_births(state)
        return state

    def _record_anchors(self, state: PlainState) -> None:
        for number, level in enumerate(state.levels, 1):
            self._record_note(f"level {number}: ids of the anchors' Gaussians", level.owners)
            self._record_note(f"level {number}: positions of the anchors", level.positions)
            if number < len(state.levels):
                self._record_note(f"level {number}: parents of the anchors", level.parents)
            anchors = [level.binding[g.id] for g in state.gaussians]
            self._record_note(f"level {number}: anchors that the Gaussians follow", anchors)

    def _sample_anchors(self, state: PlainState) -> list[PlainLevel]:
        """Return the anchor levels of a frame that samples anchors (SPEC 6)."""
        ids = [g.id for g in state.gaussians]
        positions = [tuple(g.position) for g in state.gaussians]
        anchor_count = -(-len(ids) // self.header["gaussians_per_anchor"])
        levels = []
        for number in range(1, self.header["level_count"] + 1):
            anchor_indices = oracle.sample(
                ids, positions, state.phase, self.header["seed"], number, anchor_count
            )
            anchor_positions = [positions[i] for i in anchor_indices]
            anchors_of_gaussians = oracle.bind(positions, anchor_positions)
            binding = dict(zip(ids, anchors_of_gaussians, strict=True))
            owners = [ids[i] for i in anchor_indices]
            levels.append(PlainLevel(owners, [list(p) for p in anchor_positions], [], binding))
            anchor_count = max(1, anchor_count // self.header["anchor_ratio"])
        for level, coarser in pairwise(levels):
            level.parents = [coarser.binding[owner] for owner in level.owners]
        return levels

    def _bind_newborn(self, state: PlainState) -> list[PlainLevel]:
        for level in state.levels:
            for g in state.gaussians:
                if g.id not in level.binding:
                    anchors = [tuple(p) for p in level.positions]
                    level.binding[g.id] = oracle.bind([tuple(g.position)], anchors)[0]
        return state.levels

    def _apply_motion(self, state: PlainState) -> None:
        """Read the motion and apply it to the Gaussians (SPEC 8.7, 7.5)."""
        previous = {g.id: g.motion for g in state.gaussians}
        if not self.fields["previous_contexts"]:
            previous = {}
        channels = 3 + self.header["rotation_components"]
        section = self._open_section("motion", self.fields["motion"], state.counts)
        read_motion(section, channels, previous, state.levels)
        self._close_section(section)
        for number, level in enumerate(state.levels, 1):
            self._record_note(f"level {number}: expected values of the anchors", level.expected)
            self._record_note(f"level {number}: symbols of the anchors", level.symbols)
        step, unity = self.header["translation_step"], self.header["rotation_unity"]
        for g in state.gaussians:
            anchor_symbols = [level.symbols[level.binding[g.id]] for level in state.levels]
            g.motion = [sum(channel) for channel in zip(*anchor_symbols, strict=True)]
            coordinates_and_motion = zip(g.position, g.motion[:3], strict=True)
            rotation_sum = [0] * (7 - len(g.motion)) + g.motion[3:]
            rotation = g.rotation
            if any(rotation_sum):
                rotation_sum[0] += len(state.levels) * unity
                rotation = oracle.rotate(g.rotation, rotation_sum)
            g.position, g.rotation = [p + step * t for p, t in coordinates_and_motion], rotation

    def _apply_updates(self, state: PlainState) -> None:
        """Read the updates, and apply them (SPEC 8.8, 7.8)."""
        self._record_note("recency of the Gaussians", [g.recency for g in state.gaussians])
        section = self._open_section("updates", self.fields["updates"], state.counts)
        changes = read_updates(section, state.gaussians)
        self._close_section(section)
        for number, residuals in changes.items():
            self._record_note(
                f"update of Gaussian {number}", "deleted" if residuals is None else residuals
            )
        step, unity = self.header["translation_step"], self.header["rotation_unity"]
        state.gaussians = apply_updates(state.gaussians, changes, step, unity)

    def _append_births(self, state: PlainState) -> None:
        """Read the births, and append them to the state (SPEC 8.6, 7.6)."""
        count, step = self.fields["birth_count"], self.header["position_step"]
        section = self._open_section("births", self.fields["births"], state.counts)
        parents = gaussians.read_keys(section, "births parents", count)
        position_rows = read_rows_in_one_context(section, "births positions", count, 3)
        sh_dc = gaussians.read_colors(section, "births SH DC", count)
        opacity = read_rows_in_one_context(section, "births opacity", count, 1)
        scales = gaussians.read_log_scales(section, "births log-scales", count)
        rotations = self._read_rotations(section, "births rotations", count)
        sh_rest = []
        if self.has_sh_rest:
            sh_rest = gaussians.read_newborn_sh_rest(section, "births SH rest", count)
        self._close_section(section)
        existing_gaussians = list(state.gaussians)
        for i, parent in enumerate(parents):
            assert parent < len(existing_gaussians), "parent-range"
            parent_position = existing_gaussians[parent].position
            codes = [row[i] for row in scales + opacity + sh_dc + sh_rest]
            assert max(map(abs, codes)) <= 32767, "code-range"
            residual = [row[i] for row in position_rows]
            self._record_note(f"newborn {state.next_id}: parent", parent)
            self._record_note(f"newborn {state.next_id}: position residual", residual)
            child_position = [p + step * r for p, r in zip(parent_position, residual, strict=True)]
            motion = [0] * len(state.gaussians[0].motion)
            state.gaussians.append(
                PlainGaussian(state.next_id, child_position, rotations[i], codes, motion, 0)
            )
            state.next_id += 1


@cache
def _split_key(key: int) -> list[int]:
    """Return the three components whose bits a Morton key interleaves (SPEC 8.5)."""
    return [sum((key >> (3 * b + 2 - a) & 1) << b for b in range(20)) for a in range(3)]
