"""Downloads and installs wheels of packages that a machine with a GPU may lack."""

import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

REQUIREMENTS_PATH = Path(__file__).with_name("wheels.txt")


def read_requirements() -> list[str]:
    """Return the requirements of `wheels.txt`, each of the form `name==version`."""
    lines = (line.partition("#")[0].strip() for line in REQUIREMENTS_PATH.read_text().splitlines())
    return [line for line in lines if line]


def fetch_wheels(folder: Path, python_version: str) -> int:
    """Download the wheels into a folder.

    Args:
        folder: Folder for the wheels, created if it does not exist.
        python_version: Python version of the wheels, such as 3.12.

    Returns:
        Exit code of pip.
    """
    # The manylinux tags of x86-64 that pip matches exactly, newest first.
    platforms = [f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 17)] + ["manylinux2014_x86_64"]
    platform_options = [f"--platform={name}" for name in platforms]
    command = [sys.executable, "-m", "pip", "download", "--no-deps", "--only-binary=:all:"]
    command += [
        *platform_options,
        f"--python-version={python_version}",
        "--dest",
        str(folder),
        "-r",
        str(REQUIREMENTS_PATH),
    ]
    return subprocess.run(command, check=False).returncode


def locate_packages(wheels: Path) -> Path:
    """Return the folder for installed packages, which is added to `PYTHONPATH`.

    The folder is the same in every run, because gsplat recompiles its kernels if its path changes.
    """
    return wheels.absolute() / "installed"


def install_missing(wheels: Path) -> str:
    """Install the packages listed in `wheels.txt` that are missing, from a folder of wheels.

    Packages that are already installed stay unchanged, because the PyTorch of the machine may
    require their versions.

    Args:
        wheels: Folder to which `fetch_wheels` downloaded the wheels.

    Returns:
        A message that lists the newly installed packages.

    Raises:
        RuntimeError: pip fails.
    """
    target = locate_packages(wheels)
    missing = [
        line for line in read_requirements() if not _is_installed(line.partition("==")[0], target)
    ]
    if not missing:
        return "nothing is missing"
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    command += ["--disable-pip-version-check", "--find-links", str(wheels), "--target", str(target)]
    process = subprocess.run([*command, *missing], check=False, capture_output=True, text=True)
    if process.returncode:
        message = f"pip cannot install the wheels: {process.stderr.strip().splitlines()[-1]}"
        raise RuntimeError(message)
    return f"installed {', '.join(missing)}"


def _is_installed(name: str, target: Path) -> bool:
    search_paths = [*sys.path, str(target)]
    return any(True for _ in distributions(name=name, path=search_paths))
