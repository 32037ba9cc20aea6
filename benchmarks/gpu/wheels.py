"""Packages that a machine with a GPU may lack: downloads their wheels and installs them."""

import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

LIST = Path(__file__).with_name("wheels.txt")


def read_list() -> list[str]:
    """Return the requirements of `wheels.txt`, each of the form `name==version`."""
    lines = (line.partition("#")[0].strip() for line in LIST.read_text().splitlines())
    return [line for line in lines if line]


def fetch(folder: Path, python: str) -> int:
    """Download the wheels into a folder.

    Args:
        folder: Created if it does not exist.
        python: Python version of the wheels, such as 3.12.

    Returns:
        pip's exit code.
    """
    # The manylinux tags of x86-64 that pip matches exactly, newest first.
    platforms = [f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 17)] + ["manylinux2014_x86_64"]
    chosen = [f"--platform={name}" for name in platforms]
    command = [sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:"]
    command += [*chosen, f"--python-version={python}", "--dest", str(folder), "-r", str(LIST)]
    return subprocess.run(command, check=False).returncode


def name_packages(wheels: Path) -> Path:
    """Return the folder of installed packages for `PYTHONPATH`.

    It is kept between runs, because gsplat compiles its kernels again if its sources move.
    """
    return wheels.absolute() / "installed"


def install_missing(wheels: Path) -> str:
    """Install the missing packages of the list, only from wheels.

    Installed packages of any version are kept, because the machine's PyTorch was built for them.

    Args:
        wheels: What `fetch` filled.

    Returns:
        A sentence that lists the installed packages.

    Raises:
        RuntimeError: pip cannot install them.
    """
    target = name_packages(wheels)
    missing = [line for line in read_list() if not _is_installed(line.partition("==")[0], target)]
    if not missing:
        return "nothing is missing"
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    command += ["--disable-pip-version-check", "--find-links", str(wheels), "--target", str(target)]
    done = subprocess.run([*command, *missing], check=False, capture_output=True, text=True)
    if done.returncode:
        message = f"pip: {done.stderr.strip().splitlines()[-1]}"
        raise RuntimeError(message)
    return f"installed {', '.join(missing)}"


def _is_installed(name: str, target: Path) -> bool:
    places = [*sys.path, str(target)]
    return any(True for _ in distributions(name=name, path=places))
