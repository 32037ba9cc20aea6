"""Runs command lines in separate processes, for tests of pipes and growing files."""

import subprocess
import sys

COMMAND = [sys.executable, "-m", "quarc_ref"]

# Writes a frame of a stream for each line of standard input, and prints its ordinal.
SLOW_ENCODER = """
import sys
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.format.records import StreamHeader
from tests.small_streams import CAMERA, make_gaussians, make_symbols

header = StreamHeader(gaussians_per_anchor=4)
with open(sys.argv[1], "wb") as sink:
    loop = ClosedLoop(sink, header, (CAMERA,), {})
    state = loop.commit_canonical(make_gaussians(header, 30), 0)
    print(0, flush=True)
    for line in sys.stdin:
        start = loop.start_frame(0)
        frame = start.state.scene.frame
        moved = loop.move_frame(start, make_symbols(start.state, frame))
        loop.commit_frame(moved, None)
        print(frame, flush=True)
    loop.finish()
"""


def run_piped(*arguments, data=b""):
    """Run a command line with bytes on its standard input."""
    command = [*COMMAND, *map(str, arguments)]
    return subprocess.run(command, input=data, capture_output=True, timeout=60, check=False)


def start(*arguments, program=None, **pipes):
    """Start the command, or Python code in its place, with arguments; return the process."""
    command = COMMAND if program is None else [sys.executable, "-c", program]
    return subprocess.Popen([*command, *map(str, arguments)], **pipes)
