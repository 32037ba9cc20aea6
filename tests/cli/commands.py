"""Runs the command in this process."""

import json

from typer.testing import CliRunner

from quarc_ref.cli.app import app
from quarc_ref.export.sidecar import SIDECAR_NAME as SIDECAR
from quarc_ref.files import MARKER_NAME, growing_folder
from tests.cli.schemas import validate

# A few iterations of everything: the pictures are bad, but the stream is complete.
TINY = {
    "canonical.lambda_dssim": 0.2,  # more would leave Gaussians half transparent
    "canonical.iterations": 8,
    "canonical.initial_gaussians": 60,
    "canonical.max_gaussians": 70,
    "canonical.densify_from_iter": 3,
    "canonical.densify_until_iter": 6,
    "canonical.densification_interval": 3,
    "motion.iterations": 3,
    "births.iterations": 2,
    "births.grad_threshold": 0,
    "births.rd_selection": False,
}
TINY_OPTIONS = [part for key, value in TINY.items() for part in ("--set", f"{key}={value}")]


def run(*arguments):
    """Run a command line; tracebacks fail the test."""
    result = CliRunner().invoke(app, [str(argument) for argument in arguments])
    assert "Traceback" not in result.stderr
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result


def run_json(*arguments):
    """Return the output of a command with --json, which must be only JSON."""
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.stderr
    return read_json(result.stdout)


def read_json(text):
    """Validate JSON against the schema that it names, and return the rest."""
    printed_output = json.loads(text)
    validate(printed_output)
    del printed_output["schema"]
    return printed_output


def list_names(folder):
    """The sorted contents of a folder, without the marker and the sidecar."""
    return sorted(path.name for path in folder.iterdir() if path.name not in (MARKER_NAME, SIDECAR))


def make_folder(path, *names, text="old"):
    """Make a folder like the command does, with small files."""
    with growing_folder(path) as made:
        for name in names:
            made.write(name, text.encode())
    return path
