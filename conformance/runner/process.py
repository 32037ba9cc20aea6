"""Runs a decoder as a process; yields the lines that it prints, or raises `FaultError`."""

import json
import queue
import shlex
import subprocess
import threading
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from runner.limits import Limits, ResourceMonitor, kill_process_group

Line = dict[str, Any]
GARBAGE, CRASH, STATUS = "garbage", "crash", "status"
_POLL_SECONDS = 0.02
_MAX_STDERR_BYTES = 2000
_MAX_LINE_BYTES = 1 << 20


class FaultError(Exception):
    """A command failed without giving a valid result, or was stopped.

    Attributes:
        verdict: Name of the verdict; one of `judge.VERDICTS`.
    """

    def __init__(self, verdict: str, message: str) -> None:
        super().__init__(message)
        self.verdict = verdict


class StartError(Exception):
    """A command cannot be started; this is a mistake of the user, not a fault of the codec."""


class CodecProcess:
    """The process of a decoder or an encoder.

    Args:
        command: Command line in shell syntax; it is run without a shell.
        limits: Limits of each case.
        extra_arguments: Arguments to append to the command.

    Raises:
        StartError: The command cannot be started.
    """

    def __init__(self, command: str, limits: Limits, *extra_arguments: str) -> None:
        self._limits = limits
        self._process = _start_process([*_split_command(command), *extra_arguments], limits)
        self._lines: queue.Queue[bytes | None] = queue.Queue()
        self._stderr_tail = b""
        self.monitor = ResourceMonitor(self._process.pid, limits)
        for reader in (self._read_output, self._read_errors):
            threading.Thread(target=reader, daemon=True).start()

    def begin_case(self) -> None:
        """Restart the time limit for the next case."""
        self.monitor = ResourceMonitor(self._process.pid, self._limits)

    def send(self, data: bytes, *, last: bool = False) -> None:
        """Send bytes to the process in the background; if `last`, then close its standard input."""
        threading.Thread(target=self._write, args=(data, last), daemon=True).start()

    def feed(self, data: bytes) -> None:
        """Send bytes to the process, and wait until they are written to its standard input."""
        self._write(data, last=False)

    def read_lines(self) -> Iterator[Line]:
        """Yield the lines that the process prints until it closes its output.

        Raises:
            FaultError: The decoder exceeds a limit, or prints a line that is not a JSON object.
        """
        while (raw := self._next_line()) is not None:
            yield parse_line(raw)

    def finish(self) -> int:
        """Return the exit status of a decoder that has closed its output.

        Raises:
            FaultError: The decoder was ended by a signal, or exceeded a limit.
        """
        while self._process.poll() is None:
            self._check_limits()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_POLL_SECONDS)
        status = self._process.returncode
        if status < 0:
            raise FaultError(
                self._classify_crash(), f"ended by signal {-status}: {self.get_stderr_tail()}"
            )
        return status

    def get_stderr_tail(self) -> str:
        """Return the last 300 bytes that the process wrote to standard error, as one line."""
        return self._stderr_tail[-300:].decode(errors="replace").strip().replace("\n", " | ")

    def make_crash_fault(self, status: int) -> FaultError:
        """Return the fault of a decoder that ended with this exit status and without a result."""
        return FaultError(self._classify_crash(), f"exit status {status}: {self.get_stderr_tail()}")

    def kill(self) -> None:
        """Kill the process, and close its pipes."""
        kill_process_group(self._process.pid)
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            if pipe is not None:
                with suppress(OSError, ValueError):
                    pipe.close()

    def _next_line(self) -> bytes | None:
        while True:
            try:
                return self._lines.get(timeout=_POLL_SECONDS)
            except queue.Empty:
                self._check_limits()

    def _check_limits(self) -> None:
        verdict = self.monitor.find_exceeded_limit()
        if verdict is not None:
            raise FaultError(
                verdict,
                f"the command used more {'time' if verdict == 'timeout' else verdict} than allowed",
            )

    def _classify_crash(self) -> str:
        stderr = self._stderr_tail.lower()
        patterns = (
            b"memoryerror",
            b"out of memory",
            b"bad_alloc",
            b"cannot allocate",
            b"heap limit",
        )
        return "memory" if any(pattern in stderr for pattern in patterns) else "crash"

    def _write(self, data: bytes, last: bool) -> None:
        assert self._process.stdin is not None
        with suppress(OSError, ValueError):
            self._process.stdin.write(data)
            self._process.stdin.flush()
            if last:
                self._process.stdin.close()

    def _read_output(self) -> None:
        assert self._process.stdout is not None
        with suppress(OSError, ValueError):
            while raw := self._process.stdout.readline(_MAX_LINE_BYTES):
                self._lines.put(raw)
        self._lines.put(None)

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        with suppress(OSError, ValueError):
            while piece := self._process.stderr.read(1 << 12):
                self._stderr_tail = (self._stderr_tail + piece)[-_MAX_STDERR_BYTES:]


def _split_command(command: str) -> list[str]:
    """Split a command into its arguments.

    Raises:
        StartError: The command is empty, or has an unclosed quotation mark.
    """
    try:
        arguments = shlex.split(command)
    except ValueError as error:
        message = f"the command {command!r} cannot be read: {error}"
        raise StartError(message) from error
    if not arguments:
        message = "the command is empty"
        raise StartError(message)
    return arguments


def _start_process(arguments: list[str], limits: Limits) -> subprocess.Popen[bytes]:
    """Start a program with pipes for input and output.

    Raises:
        StartError: The program cannot be started.
    """
    try:
        return subprocess.Popen(
            arguments,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            preexec_fn=limits.limit_data_segment,
        )
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        message = f"{arguments[0]!r} cannot be started: {getattr(error, 'strerror', None) or error}"
        raise StartError(message) from error


def parse_line(raw: bytes) -> Line:
    """Return a line as a JSON object.

    Raises:
        FaultError: The line is not a JSON object.
    """
    try:
        line = json.loads(raw)
    except (ValueError, RecursionError):
        line = None
    if not isinstance(line, dict):
        message = f"the command printed a line that is not a JSON object: {raw[:60]!r}"
        raise FaultError(GARBAGE, message)
    return line
