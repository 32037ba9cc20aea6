"""Runs a decoder with whole streams, with many jobs in one process, or with chunk after chunk."""

import json
import sys
from collections.abc import Iterator
from typing import Any

from runner.cases import Case
from runner.judge import Verdict, judge
from runner.limits import Limits
from runner.manifest import LEVELS, Suite
from runner.process import CRASH, STATUS, CodecProcess, FaultError

Line = dict[str, Any]
_EXIT_STATUSES = {"refused": 1, "declined": 3}
_STARTUP_SECONDS = 20.0


def query_capabilities(command: str, limits: Limits) -> Line:
    """Return the line that a decoder prints with `--capabilities`; empty if it prints no such line.

    A decoder that does not support this argument may print anything.
    """
    decoder = CodecProcess(command, Limits(_STARTUP_SECONDS, limits.memory_mib), "--capabilities")
    decoder.send(b"", last=True)
    capabilities: Line = {}
    message = ""
    try:
        capabilities = next(iter(decoder.read_lines()), {})
    except FaultError as error:
        message = str(error)
    decoder.kill()
    names = (capabilities.get("capabilities"), capabilities.get("units", []))
    levels = capabilities.get("levels", list(LEVELS))
    if all(map(_is_text_list, names)) and _is_level_list(levels):
        return capabilities
    if "capabilities" in (message or capabilities):
        detail = message or "a list is missing, or contains what RUNNER.md does not allow"
        print(f"run.py: the answer to --capabilities is ignored: {detail}", file=sys.stderr)
    return {}


def _is_text_list(value: object) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _is_level_list(value: object) -> bool:
    return isinstance(value, list) and bool(value) and all(level in LEVELS for level in value)


class CaseRunner:
    """Tests a decoder with one case after another.

    Args:
        command: Command line of the decoder.
        suite: Suite that contains the streams.
        limits: Limits of each case.
        supports_jobs: Whether the decoder supports many jobs in one process.
    """

    def __init__(self, command: str, suite: Suite, limits: Limits, *, supports_jobs: bool) -> None:
        self._command = command
        self._suite = suite
        self._limits = limits
        self._supports_jobs = supports_jobs
        self._worker: CodecProcess | None = None

    def run_case(self, case: Case) -> Verdict:
        """Run one case, and return the verdict on the decoder."""
        try:
            if case.mode == "grow":
                return self._run_growing(case)
            return judge(
                case, self._run_job(case) if self._supports_jobs else self._run_in_new_process(case)
            )
        except FaultError as fault:
            self.close()
            return Verdict(fault.verdict, str(fault))

    def close(self) -> None:
        """Stop the process that runs jobs."""
        if self._worker is not None:
            self._worker.kill()
            self._worker = None

    def _run_in_new_process(self, case: Case) -> list[Line]:
        decoder = CodecProcess(self._command, self._limits)
        try:
            decoder.send(self._suite.read_stream(case.vector), last=True)
            lines = list(decoder.read_lines())
            _check_status(decoder, lines)
        finally:
            decoder.kill()
        return lines

    def _run_job(self, case: Case) -> list[Line]:
        return self.run_job(
            case.job, b"" if case.mode == "unit" else self._suite.read_stream(case.vector)
        )

    def run_job(self, job: Line, stream: bytes) -> list[Line]:
        """Return the decoder's answer to a job.

        Raises:
            FaultError: The decoder gives no answer, or exceeds a limit.
        """
        if self._worker is None:
            self._worker = CodecProcess(self._command, self._limits, "--jobs")
        worker = self._worker
        worker.begin_case()
        worker.send(json.dumps(job | {"bytes": len(stream)}).encode() + b"\n" + stream)
        lines: list[Line] = []
        for line in worker.read_lines():
            if line.get("done"):
                return lines
            lines.append(line)
        raise worker.make_crash_fault(worker.finish())

    def _run_growing(self, case: Case) -> Verdict:
        """Feed a stream chunk by chunk; the decoder must print each frame before the next chunk."""
        stream, printed_lines = self._suite.read_stream(case.vector), []
        decoder = CodecProcess(self._command, self._limits)
        lines = decoder.read_lines()
        try:
            for chunk, is_frame in split_chunks(stream):
                decoder.feed(chunk)
                if is_frame:
                    printed_lines.append(_read_next_line(lines, len(printed_lines)))
                    if "frame" not in printed_lines[-1]:
                        break
            decoder.send(b"", last=True)
            printed_lines += list(lines)
            _check_status(decoder, printed_lines)
        except FaultError as fault:
            if fault.verdict != "timeout" or not printed_lines:
                raise
            return Verdict(
                "missing",
                f"frame {len(printed_lines)} was not printed before the next chunk was sent",
            )
        finally:
            decoder.kill()
        return judge(case, printed_lines)


def _read_next_line(lines: Iterator[Line], number: int) -> Line:
    line = next(lines, None)
    if line is None:
        raise FaultError(CRASH, f"the decoder ended before frame {number}")
    return line


def _check_status(decoder: CodecProcess, lines: list[Line]) -> None:
    """Raise `FaultError` if the exit status does not match the printed lines."""
    status = decoder.finish()
    last_line = lines[-1] if lines else {}
    expected = next((code for key, code in _EXIT_STATUSES.items() if key in last_line), 0)
    if status == expected:
        return
    if expected and status in {0, *_EXIT_STATUSES.values()}:
        raise FaultError(STATUS, f"exit status {status}, expected {expected}")
    raise decoder.make_crash_fault(status)


def split_chunks(stream: bytes) -> Iterator[tuple[bytes, bool]]:
    """Yield the chunks of a valid stream, and whether each contains a frame."""
    offset, start = 8, 0
    while offset < len(stream):
        kind = stream[offset + 4 : offset + 8]
        end = offset + 24 + int.from_bytes(stream[offset + 12 : offset + 16], "little")
        yield stream[start:end], kind in (b"CANO", b"SNAP", b"FRAM")
        offset = start = end
