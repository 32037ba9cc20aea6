"""Tests an encoder: compares its declarations with its decoded stream.

A trusted decoder decodes the stream; see RUNNER.md, Encoders.
"""

import json
import struct
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from runner.asking import CaseRunner, split_pieces
from runner.cases import Case
from runner.judge import PASS, Verdict
from runner.limits import Limits
from runner.manifest import Suite
from runner.process import Decoder, FaultError

Line = dict[str, Any]
Rows = list[tuple[float, ...]]
LEVELS = {10: (65536, 4096, 1 << 22), 20: (262144, 16384, 1 << 24), 30: (1 << 20, 65536, 1 << 26)}
_UNLIMITED = 31
_HEAD_LEVEL = 10
_PARTS = {"position": 3, "rotation": 4, "log_scales": 3, "opacity": 1, "sh_dc": 3, "sh_rest": 9}


def try_encoder(encoder: str, decoder: str, scene: Path, limits: Limits) -> Verdict:
    """Return the verdict on an encoder for one scene."""
    with tempfile.TemporaryDirectory() as folder:
        output = Path(folder) / "stream.quarc"
        try:
            declared = _encode(encoder, scene, output, limits)
            stream = output.read_bytes()
            said = _decode(decoder, stream, limits)
        except FaultError as fault:
            return Verdict(fault.verdict, str(fault))
        except OSError as error:
            return Verdict("silent", f"no stream: {error}")
    return judge_encoder(json.loads(scene.read_text("utf-8")), declared, stream, said)


def judge_encoder(scene: Line, declared: list[Line], stream: bytes, said: list[Line]) -> Verdict:
    """Compare a scene, the declarations and the decoded frames with each other."""
    if not declared or "bounds" not in declared[-1] or "level" not in declared[-1]:
        return Verdict("silent", "no level and bounds were declared")
    if said and "refused" in said[-1]:
        return Verdict("refused", f"the stream is rejected: {said[-1]['refused']}")
    mine = [(line.get("frame"), line.get("sha256")) for line in declared[:-1]]
    if mine != [(line["frame"], line["sha256"]) for line in said] or not mine:
        return Verdict("wrong", "the declared states differ from the decoded ones")
    if len(said) != 1 + len(scene["frames"]):
        return Verdict("missing", f"{len(said)} frames of {1 + len(scene['frames'])}")
    return (
        _judge_level(declared[-1]["level"], stream, said)
        or _judge_bounds(scene, declared[-1]["bounds"], said)
        or Verdict(PASS)
    )


def _encode(encoder: str, scene: Path, output: Path, limits: Limits) -> list[Line]:
    process = Decoder(encoder, limits, str(scene), str(output))
    try:
        process.send(b"", last=True)
        lines = list(process.lines())
        status = process.finish()
        if status:
            raise process.crash(status)
    finally:
        process.kill()
    return lines


def _decode(decoder: str, stream: bytes, limits: Limits) -> list[Line]:
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "stream").write_bytes(stream)
        suite = Suite(Path(folder), {}, [])
        case_runner = CaseRunner(decoder, suite, limits, jobs=True)
        try:
            return case_runner.run_job({"job": "decode", "values": True}, stream)
        finally:
            case_runner.close()


def _judge_level(level: int, stream: bytes, said: list[Line]) -> Verdict | None:
    """Compare the level of HEAD with the lowest sufficient one."""
    chunks = [piece for piece, _ in split_pieces(stream)]
    head = chunks[0][8 + 20 + _HEAD_LEVEL]
    payloads = [chunk[20:-4] for chunk in chunks[1:]]
    births = [
        int.from_bytes(p[9:13], "little")
        for p, c in zip(payloads, chunks[1:], strict=True)
        if c[4:8] == b"FRAM"
    ]
    used = (
        max(line["gaussians"] for line in said),
        max(births, default=0),
        max(map(len, payloads)),
    )
    measured = next(
        (n for n, most in LEVELS.items() if all(map(int.__le__, used, most))), _UNLIMITED
    )
    if not level == head == measured:
        return Verdict("level", f"{level} is declared, HEAD says {head}, {measured} would do")
    return None


def _judge_bounds(scene: Line, bounds: dict[str, float], said: list[Line]) -> Verdict | None:
    """Compare the numbers of every frame with those of the scene."""
    before: list[dict[str, tuple[float, ...]]] = []
    for number, line in enumerate(said):
        there = list(_split(line, scene["header"]["sh_degree"]))
        due = scene["canonical"] if number == 0 else scene["frames"][number - 1].get("births", [])
        if len(there) != len(before) + len(due):
            return Verdict(
                "missing", f"{len(there)} Gaussians in frame {number}, not {len(before) + len(due)}"
            )
        fault = _match(due, there[len(before) :], bounds)
        if number and not fault:
            shift = scene["frames"][number - 1].get("shift", (0.0, 0.0, 0.0))
            fault = _moved(before, there, shift, bounds["shift"])
        if fault:
            return Verdict("bounds", f"frame {number}: {fault}")
        before = there
    return None


def _split(line: Line, degree: int) -> Iterator[dict[str, tuple[float, ...]]]:
    """Yield the numbers of each Gaussian of a frame."""
    data, count = bytes.fromhex(line["values"]), line["gaussians"]
    values = struct.unpack(f"<{len(data) // 4}f", data)
    rows = [values[start : start + count] for start in range(0, len(values), count)]
    for column in zip(*rows, strict=True):
        place, parts = 0, {}
        for name, size in list(_PARTS.items())[: 5 + degree]:
            parts[name], place = column[place : place + size], place + size
        yield parts


def _match(
    due: list[Line], there: list[dict[str, tuple[float, ...]]], bounds: dict[str, float]
) -> str:
    """Match a decoded Gaussian to each of the scene, in any order."""
    left = list(there)
    for gaussian in due:
        found = next((each for each in left if _is_near(gaussian, each, bounds)), None)
        if found is None:
            return f"none is within the bounds of that at {gaussian['position']}"
        left.remove(found)
    return ""


def _is_near(gaussian: Line, there: dict[str, tuple[float, ...]], bounds: dict[str, float]) -> bool:
    return all(_distance(name, gaussian[name], there[name]) <= bounds[name] for name in there)


def _distance(name: str, due: list[float], there: tuple[float, ...]) -> float:
    """The greatest difference of a component; for rotations, with either sign."""
    plus = max(abs(a - b) for a, b in zip(due, there, strict=True))
    minus = max(abs(a + b) for a, b in zip(due, there, strict=True))
    return min(plus, minus) if name == "rotation" else plus


def _moved(
    before: list[dict[str, tuple[float, ...]]],
    there: list[dict[str, tuple[float, ...]]],
    shift: Any,
    bound: float,
) -> str:
    for old, new in zip(before, there, strict=False):
        places = zip(old["position"], new["position"], shift, strict=True)
        if max(abs(b - a - s) for a, b, s in places) > bound:
            return f"the Gaussian at {old['position']} has not moved by {list(shift)}"
    return ""


def encoder_case(scene: Path) -> Case:
    """Return the case of a scene, for reports."""
    return Case(f"encoder/{scene.stem}", "encoder", "encode", ("1-4",), scene.stem, {}, {})
