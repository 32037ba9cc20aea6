"""Converts single-frame files between formats with the library gaussforge."""

import subprocess
import sys
from importlib.util import find_spec

from quarc_ref.export.errors import ExportError

_TIMEOUT_SECONDS = 600


def convert(data: bytes, source_format: str, target_format: str, **options: int) -> bytes:
    """Convert a file of Gaussians to another format.

    Args:
        data: Bytes of the file.
        source_format: Format of the file: `ply`, `spz` or `sog`.
        target_format: Format of the result.
        options: Options of the library.

    Raises:
        ExportError: The library rejects the file.
        ImportError: The library is not installed.
    """
    from gaussforge import GaussForge

    result = GaussForge().convert(data, source_format, target_format, **options)
    if "error" in result:
        message = (
            f"gaussforge cannot convert {source_format.upper()} to {target_format.upper()}: "
            f"{result['error']}"
        )
        raise ExportError(message)
    converted: bytes = result["data"]
    return converted


def convert_in_subprocess(data: bytes, source_format: str, target_format: str) -> bytes:
    """Convert an untrusted file in a separate process; see `convert`.

    If the library crashes on a damaged file or prints to the console, this process is not
    affected.

    Raises:
        ExportError: The library rejects the file, or fails.
        ImportError: The library is not installed.
    """
    if find_spec("gaussforge") is None:
        message = "gaussforge is not installed"
        raise ImportError(message, name="gaussforge")
    # -P ignores modules in the current folder; -I would also ignore packages of the user.
    command = [sys.executable, "-P", "-c", _CHILD_PROGRAM, source_format, target_format]
    try:
        completed = subprocess.run(
            command, input=data, capture_output=True, timeout=_TIMEOUT_SECONDS, check=False
        )
    except subprocess.TimeoutExpired as error:
        message = f"gaussforge did not read the file within {_TIMEOUT_SECONDS} seconds"
        raise ExportError(message) from error
    if completed.returncode or not completed.stdout:  # damaged files become empty ones
        lines = completed.stderr.decode(errors="replace").strip().splitlines()
        cause = lines[-1] if lines else f"no data, and exit code {completed.returncode}"
        message = f"gaussforge cannot read the file: {cause}"
        raise ExportError(message)
    return completed.stdout


# The library prints to standard output, so the result is written to a duplicate descriptor.
_CHILD_PROGRAM = """
import os
import sys
from gaussforge import GaussForge
sink = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)
source, target = sys.argv[1:]
result = GaussForge().convert(sys.stdin.buffer.read(), source, target)
if "error" in result:
    sys.exit(str(result["error"]))
with sink:
    sink.write(result["data"])
"""
