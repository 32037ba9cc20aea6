"""Runs command lines of quarc-ref in this process, and reads their output."""

import json

from typer.testing import CliRunner

from quarc_ref.cli.app import app
from quarc_ref.export.sidecar import SIDECAR_NAME as SIDECAR
from quarc_ref.files import MARKER_NAME, growing_folder
from tests.cli.schemas import validate

# A few iterations of each training stage: the pictures are bad, but the stream is complete.
TINY = {
    "canonical.lambda_dssim": 0.2,  # more would leave Gaussians half transparent
    "canonical.iterations": 8,
    "canonical.initial_gaussians": 60,
    "canonical.max_gaussians": 70,
    "canonical.densify_from_iter": 3,
    "canonical.densify_until_iter": 6,
    "canonical.densification_interval": 3,
    "canonical.prune_rd_lambda": 0,
    "motion.iterations": 3,
    "births.iterations": 2,
    "births.grad_threshold": 0,
    "births.rd_selection": False,
}
TINY_OPTIONS = [part for key, value in TINY.items() for part in ("--set", f"{key}={value}")]


def run(*arguments):
    """Run a command line; fails if the command prints a traceback."""
    result = CliRunner().invoke(app, [str(value) for value in arguments])
    assert "Traceback" not in result.stderr
    assert result.exception is None or isinstance(result.exception, SystemExit)
    return result


def run_json(*arguments):
    """Run a command line with --json, and return the validated output without its schema name."""
    result = run(*arguments, "--json")
    assert result.exit_code == 0, result.stderr
    return read_json(result.stdout)


def read_json(text):
    """Validate JSON text against the schema that it names; return the object without that name."""
    document = json.loads(text)
    validate(document)
    del document["schema"]
    return document


def list_names(folder):
    """Return the sorted names in a folder, except the marker and the sidecar."""
    return sorted(path.name for path in folder.iterdir() if path.name not in (MARKER_NAME, SIDECAR))


def make_folder(path, *names, text="old"):
    """Make a folder with small text files and a marker, as the command does."""
    with growing_folder(path) as output_folder:
        for name in names:
            output_folder.write(name, text.encode())
    return path
