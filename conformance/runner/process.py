"""Runs a decoder as a process; it yields lines, or raises a fault."""

import json
import queue
import shlex
import subprocess
import threading
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from runner.limits import Limits, Watch, kill_group

Line = dict[str, Any]
GARBAGE, CRASH, STATUS = "garbage", "crash", "status"
_POLL = 0.02
_TAIL = 2000
_LONGEST = 1 << 20


class FaultError(Exception):
    """A decoder did not give a result.

    Attributes:
        verdict: The verdict; one of `judge.VERDICTS`.
    """

    def __init__(self, verdict: str, message: str) -> None:
        super().__init__(message)
        self.verdict = verdict


class StartError(Exception):
    """A command cannot be started; this is not a verdict on the decoder."""


class Decoder:
    """A running decoder.

    Args:
        command: Command line in shell syntax; it is run without a shell.
        limits: Of each case.
        more: Arguments after the command's own.

    Raises:
        StartError: The command cannot be started.
    """

    def __init__(self, command: str, limits: Limits, *more: str) -> None:
        self._limits = limits
        self._process = _start([*_split(command), *more], limits)
        self._lines: queue.Queue[bytes | None] = queue.Queue()
        self._errors = b""
        self.watch = Watch(self._process.pid, limits)
        for action in (self._read_output, self._read_errors):
            threading.Thread(target=action, daemon=True).start()

    def begin_case(self) -> None:
        """Reset the limits of time and memory."""
        self.watch = Watch(self._process.pid, self._limits)

    def send(self, data: bytes, *, last: bool = False) -> None:
        """Send bytes to the decoder; bytes that it does not read are lost."""
        threading.Thread(target=self._write, args=(data, last), daemon=True).start()

    def feed(self, data: bytes) -> None:
        """Send bytes to the decoder and wait until they are written."""
        self._write(data, last=False)

    def lines(self) -> Iterator[Line]:
        """Yield the printed lines until the decoder ends.

        Raises:
            FaultError: A limit is exceeded, or a line is not a JSON object.
        """
        while (raw := self._next()) is not None:
            yield parse_line(raw)

    def finish(self) -> int:
        """Return the exit status of a decoder that has closed its output.

        Raises:
            FaultError: It was ended by a signal, or does not end.
        """
        while self._process.poll() is None:
            self._check()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_POLL)
        status = self._process.returncode
        if status < 0:
            raise FaultError(self._describe_crash(), f"ended by signal {-status}: {self.said()}")
        return status

    def said(self) -> str:
        """Return the end of what the decoder wrote to standard error."""
        return self._errors[-300:].decode(errors="replace").strip().replace("\n", " | ")

    def crash(self, status: int) -> FaultError:
        """Return the fault of a decoder that ended with a status but without a result."""
        return FaultError(self._describe_crash(), f"exit status {status}: {self.said()}")

    def kill(self) -> None:
        """End the decoder."""
        kill_group(self._process.pid)
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout, self._process.stderr):
            if pipe is not None:
                with suppress(OSError, ValueError):
                    pipe.close()

    def _next(self) -> bytes | None:
        while True:
            try:
                return self._lines.get(timeout=_POLL)
            except queue.Empty:
                self._check()

    def _check(self) -> None:
        verdict = self.watch.fault()
        if verdict is not None:
            raise FaultError(
                verdict, f"more {'time' if verdict == 'timeout' else verdict} than allowed"
            )

    def _describe_crash(self) -> str:
        words = self._errors.lower()
        signs = (b"memoryerror", b"out of memory", b"bad_alloc", b"cannot allocate", b"heap limit")
        return "memory" if any(sign in words for sign in signs) else "crash"

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
            while raw := self._process.stdout.readline(_LONGEST):
                self._lines.put(raw)
        self._lines.put(None)

    def _read_errors(self) -> None:
        assert self._process.stderr is not None
        with suppress(OSError, ValueError):
            while piece := self._process.stderr.read(1 << 12):
                self._errors = (self._errors + piece)[-_TAIL:]


def _split(command: str) -> list[str]:
    """Split a command into words.

    Raises:
        StartError: It is empty, or has an unclosed quotation.
    """
    try:
        words = shlex.split(command)
    except ValueError as error:
        message = f"the command {command!r} cannot be read: {error}"
        raise StartError(message) from error
    if not words:
        message = "the command is empty"
        raise StartError(message)
    return words


def _start(words: list[str], limits: Limits) -> subprocess.Popen[bytes]:
    """Start a program with pipes for input and output.

    Raises:
        StartError: It does not start.
    """
    try:
        return subprocess.Popen(
            words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            preexec_fn=limits.limit_data,
        )
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        message = f"{words[0]!r} cannot be started: {getattr(error, 'strerror', None) or error}"
        raise StartError(message) from error


def parse_line(raw: bytes) -> Line:
    """Return the object of a line.

    Raises:
        FaultError: It is none.
    """
    try:
        line = json.loads(raw)
    except ValueError:
        line = None
    if not isinstance(line, dict):
        message = f"no JSON object: {raw[:60]!r}"
        raise FaultError(GARBAGE, message)
    return line
