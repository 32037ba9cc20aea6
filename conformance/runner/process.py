"""Runs a decoder as a process; yields the lines that it prints, or raises `FaultError`."""

import json
import os
import selectors
import shlex
import subprocess
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from typing import IO, Any

from runner.limits import Limits, ResourceMonitor, kill_process_group

Line = dict[str, Any]
GARBAGE, CRASH, STATUS, EXTRA = "garbage", "crash", "status", "extra"
_POLL_SECONDS = 0.02
_PIECE_BYTES = 1 << 16
_MAX_STDERR_BYTES = 2000
_MAX_LINE_BYTES = 1 << 20
_MAX_LINES = 1 << 16
_MAX_OUTPUT_BYTES = 1 << 26


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

    Its pipes are served only while a method waits for the process; nothing runs in the background.

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
        self._stdin, self._stdout, self._stderr = _list_pipes(self._process)
        self._input = memoryview(b"")
        self._has_last_input = False
        self._lines: deque[bytes] = deque()
        self._partial_line = b""
        self._stderr_tail = b""
        self._selector = selectors.DefaultSelector()
        for pipe in (self._stdout, self._stderr):
            self._selector.register(pipe, selectors.EVENT_READ)
        self.begin_case()

    def begin_case(self) -> None:
        """Restart the limits for the next case."""
        self._monitor = ResourceMonitor(self._process.pid, self._limits)
        self._line_count = self._output_bytes = 0

    def send(self, data: bytes, *, last: bool = False) -> None:
        """Send bytes to the process while it is waited for; if `last`, then close its input."""
        self._input = memoryview(bytes(self._input) + data)
        self._has_last_input = last
        self._write_input()

    def feed(self, data: bytes) -> None:
        """Send bytes to the process, and wait until they are written to its standard input.

        Raises:
            FaultError: The process exceeds a limit.
        """
        self.send(data)
        while self._input:
            self._check_limits()
            self._serve_pipes(_POLL_SECONDS)

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
            self._serve_pipes(0)
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_POLL_SECONDS)
        self._serve_pipes(0)  # the last bytes of standard error
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
        self._selector.close()
        for pipe in (self._stdin, self._stdout, self._stderr):
            pipe.close()

    def _next_line(self) -> bytes | None:
        while not self._lines and self._is_registered(self._stdout):
            self._check_limits()
            self._serve_pipes(_POLL_SECONDS)
        return self._lines.popleft() if self._lines else None

    def _check_limits(self) -> None:
        verdict = self._monitor.find_exceeded_limit()
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

    def _is_registered(self, pipe: IO[bytes]) -> bool:
        return pipe in self._selector.get_map()

    def _serve_pipes(self, seconds: float) -> None:
        """Read and write what is possible without blocking, after waiting for at most `seconds`."""
        for key, _ in self._selector.select(seconds):
            if key.fileobj is self._stdin:
                self._write_input()
                continue
            piece = os.read(key.fd, _PIECE_BYTES)
            if not piece:
                self._selector.unregister(key.fileobj)
            if key.fileobj is self._stdout:
                self._take_output(piece)
            else:
                self._stderr_tail = (self._stderr_tail + piece)[-_MAX_STDERR_BYTES:]

    def _write_input(self) -> None:
        """Write as much input as the pipe accepts; discard it if the process reads no more."""
        try:
            while self._input:
                self._input = self._input[os.write(self._stdin.fileno(), self._input) :]
        except BlockingIOError:
            if not self._is_registered(self._stdin):
                self._selector.register(self._stdin, selectors.EVENT_WRITE)
            return
        except BrokenPipeError:
            self._input = memoryview(b"")
        if self._is_registered(self._stdin):
            self._selector.unregister(self._stdin)
        if self._has_last_input:
            self._stdin.close()

    def _take_output(self, piece: bytes) -> None:
        """Split output into lines; the end of the output and `_MAX_LINE_BYTES` end a line, too.

        Raises:
            FaultError: The output of the case is far larger than any case requires.
        """
        *lines, self._partial_line = (self._partial_line + piece).split(b"\n")
        self._lines.extend(lines)
        if self._partial_line and (not piece or len(self._partial_line) >= _MAX_LINE_BYTES):
            self._lines.append(self._partial_line)
            self._partial_line = b""
        self._output_bytes += len(piece)
        self._line_count += len(lines)
        if self._line_count > _MAX_LINES or self._output_bytes > _MAX_OUTPUT_BYTES:
            message = (
                f"the command printed more than {_MAX_LINES} lines or {_MAX_OUTPUT_BYTES} bytes"
            )
            raise FaultError(EXTRA, message)


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


def _list_pipes(process: subprocess.Popen[bytes]) -> tuple[IO[bytes], IO[bytes], IO[bytes]]:
    """Return standard input, which never blocks, standard output and standard error."""
    assert process.stdin is not None
    assert process.stdout is not None
    assert process.stderr is not None
    os.set_blocking(process.stdin.fileno(), False)
    return process.stdin, process.stdout, process.stderr


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
