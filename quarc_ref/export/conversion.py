"""Files of single frames from one format to another, by the library gaussforge."""

import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

from quarc_ref.export.errors import ExportError

_SECONDS = 600


def convert(data: bytes, source: str, target: str, **options: int) -> bytes:
    """Return a file of Gaussians in another format.

    Args:
        data: The file.
        source: Its format: `ply`, `spz` or `sog`.
        target: The format to make.
        options: Of the library.

    Raises:
        ExportError: The library rejects it.
        ImportError: The library is not installed.
    """
    from gaussforge import GaussForge

    result = GaussForge().convert(data, source, target, **options)
    if "error" in result:
        message = f"gaussforge makes no {target.upper()} of it: {result['error']}"
        raise ExportError(message)
    converted: bytes = result["data"]
    return converted


def convert_apart(data: bytes, source: str, target: str) -> bytes:
    """Do as `convert` for a file of unknown origin, in a process of its own.

    What the library makes of damaged files, and what it writes to standard output, is
    no matter for this process.

    Raises:
        ExportError: The library rejects the file, or fails.
        ImportError: The library is not installed.
    """
    if find_spec("gaussforge") is None:
        message = "gaussforge is not installed"
        raise ImportError(message, name="gaussforge")
    with TemporaryDirectory() as folder:
        given, made = Path(folder, "given"), Path(folder, "made")
        given.write_bytes(data)
        command = [sys.executable, "-I", "-c", _CHILD, str(given), str(made), source, target]
        try:
            done = subprocess.run(command, capture_output=True, timeout=_SECONDS, check=False)
        except subprocess.TimeoutExpired as error:
            message = f"gaussforge has not read it in {_SECONDS} seconds"
            raise ExportError(message) from error
        if done.returncode or not made.exists():
            lines = done.stderr.decode(errors="replace").strip().splitlines()
            message = f"gaussforge does not read it: {lines[-1] if lines else done.returncode}"
            raise ExportError(message)
        return made.read_bytes()


_CHILD = """
import sys
from pathlib import Path
from gaussforge import GaussForge
given, made, source, target = sys.argv[1:]
result = GaussForge().convert(Path(given).read_bytes(), source, target)
if "error" in result:
    sys.exit(str(result["error"]))
Path(made).write_bytes(result["data"])
"""
