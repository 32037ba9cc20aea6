"""Tests an encoder by comparing its declarations with its decoded stream.

A trusted decoder decodes the stream; see RUNNER.md, Encoders.
"""

import json
import math
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from runner.case_runner import CaseRunner, split_chunks
from runner.cases import Case
from runner.judge import PASS, Verdict
from runner.limits import Limits
from runner.manifest import LEVEL_OFFSET, Suite
from runner.process import CodecProcess, FaultError

Line = dict[str, Any]
LEVEL_LIMITS = {
    10: (65536, 4096, 1 << 22),
    20: (262144, 16384, 1 << 24),
    30: (1 << 20, 65536, 1 << 26),
}
_UNLIMITED_LEVEL = 31
_FRAME_KEYS = {"frame", "gaussians", "sha256", "values"}
_FIELD_SIZES = {
    "position": 3,
    "rotation": 4,
    "log_scales": 3,
    "opacity": 1,
    "sh_dc": 3,
    "sh_rest": 9,
}


def try_encoder(encoder: str, decoder: str, scene: Path, limits: Limits) -> Verdict:
    """Run an encoder on one scene, and return the verdict."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "stream.quarc"
        try:
            declared = _encode(encoder, scene, output, limits)
            stream = output.read_bytes()
            decoded = _decode(decoder, stream, limits)
        except FaultError as fault:
            return Verdict(fault.verdict, str(fault))
        except OSError as error:
            return Verdict("silent", f"the encoder wrote no stream: {error}")
    return judge_encoder(json.loads(scene.read_text("utf-8")), declared, stream, decoded)


def judge_encoder(scene: Line, declared: list[Line], stream: bytes, decoded: list[Line]) -> Verdict:
    """Return the verdict on a stream, given the lines printed by the encoder and by a decoder."""
    if not declared or "level" not in declared[-1] or not _are_bounds(declared[-1].get("bounds")):
        message = "the last line does not declare `level`, and in `bounds` a number for each bound"
        return Verdict("silent", message)
    if decoded and decoded[-1].keys() & {"refused", "declined"}:
        return Verdict("refused", f"the decoder rejects the stream: {decoded[-1]}")
    if not all(line.keys() >= _FRAME_KEYS for line in decoded):
        return Verdict("garbage", f"a line of the decoder lacks one of {sorted(_FRAME_KEYS)}")
    declared_states = [(line.get("frame"), line.get("sha256")) for line in declared[:-1]]
    if (
        declared_states != [(line["frame"], line["sha256"]) for line in decoded]
        or not declared_states
    ):
        return Verdict(
            "wrong", "the declared digests differ from the digests of the decoded frames"
        )
    if len(decoded) != 1 + len(scene["frames"]):
        return Verdict(
            "missing", f"{len(decoded)} frames were decoded, expected {1 + len(scene['frames'])}"
        )
    return (
        _judge_level(declared[-1]["level"], stream, decoded)
        or _judge_bounds(scene, declared[-1]["bounds"], decoded)
        or Verdict(PASS)
    )


def _are_bounds(bounds: object) -> bool:
    """Return whether an encoder declares a finite number for each bound."""
    return isinstance(bounds, dict) and all(
        isinstance(bounds.get(name), int | float) and math.isfinite(bounds[name])
        for name in (*_FIELD_SIZES, "shift")
    )


def _encode(encoder: str, scene: Path, output: Path, limits: Limits) -> list[Line]:
    process = CodecProcess(encoder, limits, str(scene), str(output))
    try:
        process.send(b"", last=True)
        lines = list(process.read_lines())
        status = process.finish()
        if status:
            raise process.make_crash_fault(status)
    finally:
        process.kill()
    return lines


def _decode(decoder: str, stream: bytes, limits: Limits) -> list[Line]:
    case_runner = CaseRunner(decoder, Suite(Path(), {}, []), limits, supports_jobs=True)
    try:
        return case_runner.run_job({"job": "decode", "values": True}, stream)
    finally:
        case_runner.close()


def _judge_level(declared_level: int, stream: bytes, decoded: list[Line]) -> Verdict | None:
    """Check that the declared level and the level in HEAD are both the lowest sufficient level."""
    chunks = [chunk for chunk, _ in split_chunks(stream)]
    head_level = chunks[0][LEVEL_OFFSET]
    payloads = [chunk[20:-4] for chunk in chunks[1:]]
    birth_counts = [
        int.from_bytes(p[9:13], "little")
        for p, c in zip(payloads, chunks[1:], strict=True)
        if c[4:8] == b"FRAM"
    ]
    used_resources = (
        max(line["gaussians"] for line in decoded),
        max(birth_counts, default=0),
        max(map(len, payloads)),
    )
    lowest_level = next(
        (n for n, limits in LEVEL_LIMITS.items() if all(map(int.__le__, used_resources, limits))),
        _UNLIMITED_LEVEL,
    )
    if not declared_level == head_level == lowest_level:
        return Verdict(
            "level",
            f"level {declared_level} is declared and level {head_level} is in HEAD,"
            f" but level {lowest_level} suffices",
        )
    return None


def _judge_bounds(scene: Line, bounds: dict[str, float], decoded: list[Line]) -> Verdict | None:
    """Compare the decoded Gaussians of every frame with the Gaussians of the scene."""
    previous: list[dict[str, tuple[float, ...]]] = []
    for number, line in enumerate(decoded):
        gaussians = list(_unpack_gaussians(line, scene["header"]["sh_degree"]))
        added_gaussians = (
            scene["canonical"] if number == 0 else scene["frames"][number - 1].get("births", [])
        )
        expected_count = len(previous) + len(added_gaussians)
        if len(gaussians) != expected_count:
            return Verdict(
                "missing",
                f"frame {number} has {len(gaussians)} Gaussians, expected {expected_count}",
            )
        fault = _describe_unmatched(added_gaussians, gaussians[len(previous) :], bounds)
        if number and not fault:
            shift = scene["frames"][number - 1].get("shift", (0.0, 0.0, 0.0))
            fault = _describe_wrong_shift(previous, gaussians, shift, bounds["shift"])
        if fault:
            return Verdict("bounds", f"frame {number}: {fault}")
        previous = gaussians
    return None


def _unpack_gaussians(line: Line, sh_degree: int) -> Iterator[dict[str, tuple[float, ...]]]:
    """Yield the values of each Gaussian of a frame, by field."""
    data, count = bytes.fromhex(line["values"]), line["gaussians"]
    values = struct.unpack(f"<{len(data) // 4}f", data)
    rows = [values[start : start + count] for start in range(0, len(values), count)]
    for attributes in zip(*rows, strict=True):
        offset, fields = 0, {}
        for name, size in list(_FIELD_SIZES.items())[: 5 + sh_degree]:
            fields[name], offset = attributes[offset : offset + size], offset + size
        yield fields


def _describe_unmatched(
    expected: list[Line], decoded: list[dict[str, tuple[float, ...]]], bounds: dict[str, float]
) -> str:
    """Return a message about the first expected Gaussian without a match; empty if all match."""
    candidates = list(decoded)
    for gaussian in expected:
        match = next(
            (
                candidate
                for candidate in candidates
                if _is_within_bounds(gaussian, candidate, bounds)
            ),
            None,
        )
        if match is None:
            return (
                f"no decoded Gaussian matches the one at {gaussian['position']} within the bounds"
            )
        candidates.remove(match)
    return ""


def _is_within_bounds(
    expected: Line, decoded: dict[str, tuple[float, ...]], bounds: dict[str, float]
) -> bool:
    return all(
        _compute_distance(name, expected[name], decoded[name]) <= bounds[name] for name in decoded
    )


def _compute_distance(name: str, expected: list[float], decoded: tuple[float, ...]) -> float:
    """Return the largest difference between components; q and -q are the same rotation."""
    difference = max(abs(a - b) for a, b in zip(expected, decoded, strict=True))
    negated_difference = max(abs(a + b) for a, b in zip(expected, decoded, strict=True))
    return min(difference, negated_difference) if name == "rotation" else difference


def _describe_wrong_shift(
    previous: list[dict[str, tuple[float, ...]]],
    gaussians: list[dict[str, tuple[float, ...]]],
    shift: Any,
    bound: float,
) -> str:
    for old, new in zip(previous, gaussians, strict=False):
        coordinates = zip(old["position"], new["position"], shift, strict=True)
        if max(abs(b - a - s) for a, b, s in coordinates) > bound:
            return f"the Gaussian at {old['position']} has not moved by {list(shift)}"
    return ""


def make_encoder_case(scene: Path) -> Case:
    """Return the case that represents a scene in reports."""
    return Case(f"encoder/{scene.stem}", "encoder", "encode", ("1-4",), scene.stem, {}, {})
