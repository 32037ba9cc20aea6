"""Decode a stream for conformance tests: `python -m quarc_ref.conformance < stream`.

The command reads the stream from standard input. As soon as a frame is decoded, it writes
a JSON line with the SHA-256 of the frame's state. If the stream is rejected, it writes a
line with the reject id. conformance/RUNNER.md describes the protocol.
"""

import argparse
import json
import os
import sys
from contextlib import ExitStack

from quarc_ref.conformance.jobs import (
    CAPABILITIES,
    MalformedJobError,
    answer_jobs,
    describe_stream,
)
from quarc_ref.decoder.engine import REFERENCE
from quarc_ref.decoder.engines import use_engine
from quarc_ref.format.coding.ans import PythonBitDecoder
from quarc_ref.format.coding.entropy import use_bit_decoder
from quarc_ref.streams.sources import PipeSource

_REJECTED = 1
_FAILED = 2
_DECLINED = 3
_NO_READER = 141  # as after SIGPIPE


def main() -> int:
    """Run the command.

    Returns:
        1 if the stream is rejected, 2 if a job is malformed, 3 if the stream is declined,
        otherwise 0.
    """
    options = _parse_arguments()
    with ExitStack() as stack:
        if options.coder == "python":
            stack.enter_context(use_engine(REFERENCE))
            stack.enter_context(use_bit_decoder(PythonBitDecoder))
        if options.capabilities:
            sys.stdout.write(json.dumps(CAPABILITIES) + "\n")
            sys.stdout.flush()
            return 0
        if options.jobs:
            return _answer_jobs()
        return _decode()


def _parse_arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m quarc_ref.conformance", description=__doc__)
    parser.add_argument(
        "--capabilities", action="store_true", help="print the capabilities of the decoder and exit"
    )
    parser.add_argument(
        "--jobs",
        action="store_true",
        help="run jobs from standard input instead of decoding one stream",
    )
    coders = ("fastest", "python")
    parser.add_argument("--coder", choices=coders, default="fastest", help="entropy decoder")
    return parser.parse_args()


def _answer_jobs() -> int:
    try:
        answer_jobs(sys.stdin.buffer, sys.stdout)
    except MalformedJobError as error:
        sys.stderr.write(f"quarc_ref.conformance: {error}\n")
        return _FAILED
    return 0


def _decode() -> int:
    status = 0
    for line in describe_stream(PipeSource(sys.stdin.buffer)):
        status = _REJECTED if "refused" in line else _DECLINED if "declined" in line else 0
        sys.stdout.write(json.dumps(line) + "\n")
        sys.stdout.flush()
    return status


def _main_in_pipe() -> int:
    """Run the command; if nobody reads its output any longer, end without a message."""
    try:
        return main()
    except BrokenPipeError:
        # Python flushes standard output at its exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _NO_READER


if __name__ == "__main__":
    sys.exit(_main_in_pipe())
