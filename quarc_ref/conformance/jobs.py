"""Decodes many streams in one process: the jobs of conformance/RUNNER.md.

A job is a line of JSON on standard input, followed by as many bytes of a stream as the line states.
The answer consists of JSON lines; the last line has the key `done`.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Iterator
from typing import Any, BinaryIO, TextIO

from quarc_ref.conformance.units import UNITS, answer_unit
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import BitstreamError, LimitError
from quarc_ref.streams.decode_stream import decode
from quarc_ref.streams.recover import Gap, recover
from quarc_ref.streams.source import BytesLike, Source, as_source

Line = dict[str, Any]

CAPABILITIES: Line = {
    "capabilities": [
        "jobs",
        "seek",
        "recover",
        "grow",
        "numbers",
        "metadata",
        "updates",
        "snapshots",
    ],
    "levels": sorted(LEVELS),
    "units": sorted(UNITS),
}


_PIECE_BYTES = 1 << 20
_WRONG_INPUT_ERRORS = (ArithmeticError, LookupError, MemoryError, TypeError, ValueError)


class MalformedJobError(Exception):
    """The input is not a job: a fault of the sender, which says nothing about a stream."""


def answer_jobs(requests: BinaryIO, answers: TextIO) -> None:
    """Answer jobs until the input ends.

    Raises:
        MalformedJobError: A line is not a job, the input ends within a stream, or a function
            cannot use its input.
    """
    while request := requests.readline():
        job = _parse_job(request)
        stream = _read_stream(requests, job.get("bytes", 0))
        for line in answer_job(job, stream):
            answers.write(json.dumps(line) + "\n")
        answers.write('{"done": true}\n')
        answers.flush()


def _parse_job(request: bytes) -> Line:
    """Parse a line with the key `job` and, if present, counts as `bytes` and `start`."""
    try:
        job = json.loads(request)
    except (ValueError, RecursionError):
        job = None
    if isinstance(job, dict) and isinstance(job.get("job"), str):
        counts = [job.get("bytes", 0), job.get("start", 0)]
        if all(type(count) is int and count >= 0 for count in counts):
            return job
    message = f"not a job: {request[:60].decode(errors='replace').strip()}"
    raise MalformedJobError(message)


def _read_stream(requests: BinaryIO, byte_count: int) -> bytes:
    """Read the stream of a job piece by piece, because its stated size may be wrong."""
    stream = bytearray()
    while piece := requests.read(min(byte_count - len(stream), _PIECE_BYTES)):
        stream += piece
    if len(stream) < byte_count:
        message = "the input ends within the stream of a job"
        raise MalformedJobError(message)
    return bytes(stream)


def answer_job(job: Line, stream: bytes) -> Iterator[Line]:
    """Yield the answer to one job."""
    job_kind = job["job"]
    if job_kind == "decode":
        outputs = [key for key in _DEQUANTIZED_OUTPUTS if job.get(key)]
        yield from describe_stream(stream, job.get("start", 0), outputs)
    elif job_kind == "recover":
        yield from _append_rejection(_describe_recovery(stream))
    elif job_kind == "unit":
        yield from _answer_unit_job(job)
    else:
        yield {"unsupported": job_kind}


def _answer_unit_job(job: Line) -> Iterator[Line]:
    function: Any = job.get("function")
    inputs: Any = job.get("input")
    if not isinstance(function, str) or function not in UNITS:
        yield {"unsupported": function}
        return
    try:
        yield from _append_rejection(answer_unit(function, inputs))
    except _WRONG_INPUT_ERRORS as error:
        message = f"{function} cannot use its input: {error!r}"
        raise MalformedJobError(message) from error


def describe_stream(
    stream: BytesLike | Source, start: int = 0, outputs: Iterable[str] = ()
) -> Iterator[Line]:
    """Yield a line for every frame from `start` on, and a last line if it is rejected or declined.

    Args:
        stream: A stream.
        start: Ordinal of the first frame.
        outputs: Additional outputs: `numbers` for a hash of the dequantized values, `values`
            for the values themselves.
    """
    scenes = decode(as_source(stream), start)
    yield from _append_rejection(_describe_scene(scene, outputs) for scene in scenes)


def _append_rejection(lines: Iterator[Line]) -> Iterator[Line]:
    try:
        yield from lines
    except BitstreamError as error:
        yield {"refused": error.reject_id, "message": str(error)}
    except LimitError as error:
        yield {"declined": str(error)}


def _describe_scene(scene: Scene, outputs: Iterable[str] = ()) -> Line:
    line = {"frame": scene.frame, "gaussians": scene.count, "sha256": compute_digest(scene)}
    return line | dict(_DEQUANTIZED_OUTPUTS[key](_serialize_numbers(scene)) for key in outputs)


def _describe_recovery(stream: bytes) -> Iterator[Line]:
    for item in recover(stream):
        if isinstance(item, Gap):
            gap = {"offset": item.offset, "bytes": item.byte_count}
            yield {"gap": {**gap, "refused": item.reject_id, "frames_lost": item.frames_lost}}
        else:
            yield _describe_scene(item)


def _serialize_numbers(scene: Scene) -> bytes:
    """Return the dequantized values of a scene as little-endian bytes, in the order of SPEC 9.1."""
    splats = dequantize(scene)
    rows = [splats.positions, splats.rotations, splats.log_scales, splats.opacities[:, None]]
    rows.append(splats.sh.reshape(scene.count, -1))
    return b"".join(row.T.astype("<f4").tobytes() for row in rows)


_DEQUANTIZED_OUTPUTS: dict[str, Callable[[bytes], tuple[str, str]]] = {
    "numbers": lambda numbers: ("numbers_sha256", hashlib.sha256(numbers).hexdigest()),
    "values": lambda numbers: ("values", numbers.hex()),
}
