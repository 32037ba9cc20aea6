"""Runs a decoder: a process for each stream, one process for many jobs, or piece by piece."""

import json
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from runner.cases import Case
from runner.judge import Verdict, judge
from runner.limits import Limits
from runner.manifest import Suite
from runner.process import CRASH, STATUS, Decoder, FaultError

Line = dict[str, Any]
_STATUS = {"refused": 1, "declined": 3}
_START_SECONDS = 20.0


def query_capabilities(command: str, limits: Limits) -> Line:
    """Return the capabilities that a decoder prints; none if it prints nothing."""
    decoder = Decoder(command, Limits(_START_SECONDS, limits.memory_mib), "--capabilities")
    decoder.send(b"", last=True)
    said: Line = {}
    with suppress(FaultError):
        said = next(iter(decoder.lines()), {})
    decoder.kill()
    return said if isinstance(said.get("capabilities"), list) else {}


class CaseRunner:
    """Tests a decoder with one case after another.

    Args:
        command: The decoder.
        suite: Suite with the streams.
        limits: Of each case.
        jobs: Whether the decoder supports many jobs in one process.
    """

    def __init__(self, command: str, suite: Suite, limits: Limits, *, jobs: bool) -> None:
        self._command = command
        self._suite = suite
        self._limits = limits
        self._jobs = jobs
        self._worker: Decoder | None = None

    def ask(self, case: Case) -> Verdict:
        """Return the verdict on the decoder in one case."""
        try:
            if case.mode == "grow":
                return self._run_growing(case)
            return judge(case, self._run_job(case) if self._jobs else self._run_single(case))
        except FaultError as fault:
            self.close()
            return Verdict(fault.verdict, str(fault))

    def close(self) -> None:
        """Stop the process that runs jobs."""
        if self._worker is not None:
            self._worker.kill()
            self._worker = None

    def _run_single(self, case: Case) -> list[Line]:
        decoder = Decoder(self._command, self._limits)
        try:
            decoder.send(self._suite.stream(case.vector), last=True)
            lines = list(decoder.lines())
            _check_status(decoder, lines)
        finally:
            decoder.kill()
        return lines

    def _run_job(self, case: Case) -> list[Line]:
        return self.run_job(
            case.job, b"" if case.mode == "unit" else self._suite.stream(case.vector)
        )

    def run_job(self, job: Line, stream: bytes) -> list[Line]:
        """Return the decoder's answer to a job.

        Raises:
            FaultError: There is no answer, or not within the limits.
        """
        if self._worker is None:
            self._worker = Decoder(self._command, self._limits, "--jobs")
        worker = self._worker
        worker.begin_case()
        worker.send(json.dumps(job | {"bytes": len(stream)}).encode() + b"\n" + stream)
        lines: list[Line] = []
        for line in worker.lines():
            if line.get("done"):
                return lines
            lines.append(line)
        raise worker.crash(worker.finish())

    def _run_growing(self, case: Case) -> Verdict:
        """Feed a stream chunk by chunk: a frame must be printed before the next chunk is fed."""
        stream, said = self._suite.stream(case.vector), []
        decoder = Decoder(self._command, self._limits)
        lines = decoder.lines()
        try:
            for piece, is_frame in split_pieces(stream):
                decoder.feed(piece)
                if is_frame:
                    said.append(_next_line(lines, len(said)))
            decoder.send(b"", last=True)
            said += list(lines)
            _check_status(decoder, said)
        except FaultError as fault:
            if fault.verdict != "timeout" or not said:
                raise
            return Verdict("missing", f"frame {len(said)} is not printed while the stream grows")
        finally:
            decoder.kill()
        return judge(case, said)


def _next_line(lines: Iterator[Line], number: int) -> Line:
    line = next(lines, None)
    if line is None:
        raise FaultError(CRASH, f"the decoder ended before frame {number}")
    return line


def _check_status(decoder: Decoder, lines: list[Line]) -> None:
    """Compare the exit status with the printed lines."""
    status = decoder.finish()
    last = lines[-1] if lines else {}
    due = next((code for word, code in _STATUS.items() if word in last), 0)
    if status == due:
        return
    if due and status in {0, *_STATUS.values()}:
        raise FaultError(STATUS, f"exit status {status}, expected {due}")
    raise decoder.crash(status)


def split_pieces(stream: bytes) -> Iterator[tuple[bytes, bool]]:
    """Yield a valid stream chunk by chunk, and whether a chunk is a frame."""
    place, begun = 8, 0
    while place < len(stream):
        kind = stream[place + 4 : place + 8]
        end = place + 24 + int.from_bytes(stream[place + 12 : place + 16], "little")
        yield stream[begun:end], kind in (b"CANO", b"FRAM")
        place = begun = end
