"""Tests of signals that arrive while the command starts."""

import signal
import subprocess

import pytest

from tests.cli.processes import start

_SIGNAL_IN_IMPORT = """
import signal, sys
from quarc_ref.__main__ import main

class Finder:
    def find_spec(self, name, *_):
        if name == {module!r}:
            signal.raise_signal({number})

sys.meta_path.insert(0, Finder())
sys.argv = ["quarc-ref", *sys.argv[1:]]
main()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("module", ["typer", "quarc_ref.cli.verbs", "rich"])
def test_a_signal_while_the_command_starts_ends_it_without_a_traceback(number, module):
    program = _SIGNAL_IN_IMPORT.format(module=module, number=int(number))
    process = start("encode", program=program, stderr=subprocess.PIPE)

    assert process.communicate(timeout=60)[1] == b""
    assert process.returncode == 128 + number


def test_an_ignored_ctrl_c_stays_ignored(stream_file):
    program = _SIGNAL_IN_IMPORT.format(module="typer", number=int(signal.SIGINT))
    ignoring = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\n" + program
    process = start("verify", stream_file, program=ignoring, stdout=subprocess.DEVNULL)

    assert process.wait(timeout=60) == 0
