"""Downloads and installs wheels of packages that a machine with a GPU may lack."""

import shutil
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path

REQUIREMENTS_PATH = Path(__file__).with_name("wheels.txt")
_CORE = Path(__file__).resolve().parents[2] / "core"


def read_requirements() -> list[str]:
    """Return the requirements of `wheels.txt`, each of the form `name==version`."""
    lines = (line.partition("#")[0].strip() for line in REQUIREMENTS_PATH.read_text().splitlines())
    return [line for line in lines if line]


def fetch_wheels(folder: Path, python_version: str) -> int:
    """Download the wheels into a folder, and build that of the fast engine if cargo is installed.

    Args:
        folder: Folder for the wheels, created if it does not exist.
        python_version: Python version of the downloaded wheels, such as 3.12. The wheel of the fast
            engine is valid for all versions from 3.11 on.

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
    exit_code = subprocess.run(command, check=False).returncode
    if exit_code:
        return exit_code
    if shutil.which("cargo") is None:
        print("cargo is not installed: without the fast engine, a frame takes seconds longer")
        return 0
    build = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", str(folder)]
    return subprocess.run([*build, str(_CORE)], check=False).returncode


def locate_packages(wheels: Path) -> Path:
    """Return the folder for installed packages, which is added to `PYTHONPATH`.

    The folder is the same in every run, because gsplat recompiles its kernels if its path changes.
    """
    return wheels.absolute() / "installed"


def install_missing(wheels: Path) -> str:
    """Install the packages that are missing, from a folder of wheels.

    These are the packages listed in `wheels.txt`, and the fast engine if the folder has its wheel.
    Packages that are already installed stay unchanged, because the PyTorch of the machine may
    require their versions.

    Args:
        wheels: Folder to which `fetch_wheels` downloaded the wheels.

    Returns:
        A message that lists the newly installed packages.

    Raises:
        RuntimeError: Some packages cannot be installed; all others are.
    """
    target = locate_packages(wheels)
    required = read_requirements()
    required += ["quarc-core"] if any(wheels.glob("quarc_core-*.whl")) else []
    missing = [line for line in required if not _is_installed(line.partition("==")[0], target)]
    errors = [error for line in missing if (error := _install(line, wheels, target))]
    if errors:
        message = f"pip cannot install the wheels: {'; '.join(errors)}"
        raise RuntimeError(message)
    return f"installed {', '.join(missing)}" if missing else "nothing is missing"


def _install(requirement: str, wheels: Path, target: Path) -> str:
    """Install a package from a folder of wheels; return the error, or an empty string."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index"]
    command += ["--disable-pip-version-check", "--find-links", str(wheels), "--target", str(target)]
    process = subprocess.run([*command, requirement], check=False, capture_output=True, text=True)
    if not process.returncode:
        return ""
    lines = process.stderr.strip().splitlines()
    return lines[-1] if lines else f"{requirement}: exit code {process.returncode}"


def _is_installed(name: str, target: Path) -> bool:
    search_paths = [*sys.path, str(target)]
    return any(True for _ in distributions(name=name, path=search_paths))
