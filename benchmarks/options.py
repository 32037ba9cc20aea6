"""Command-line options that several benchmarks share."""

import argparse
from pathlib import Path

from quarc_ref.jobs import WorkerPool


def parse_count(text: str) -> int:
    """Return a number of the command line that must be at least 0."""
    return _parse_int(text, 0)


def parse_positive(text: str) -> int:
    """Return a number of the command line that must be at least 1."""
    return _parse_int(text, 1)


def _parse_int(text: str, minimum: int) -> int:
    try:
        number = int(text)
    except ValueError:
        number = minimum - 1
    if number < minimum:
        message = f"{text!r} is not a whole number of at least {minimum}"
        raise argparse.ArgumentTypeError(message)
    return number


def add_set_option(parser: argparse.ArgumentParser) -> None:
    """Add the option `--set KEY=VALUE`; its values are collected in the list `set`."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a setting of the preset",
    )


def add_capture_options(parser: argparse.ArgumentParser) -> None:
    """Add the options for reading a capture: `--frames`, `--downscale` and `--held-out`."""
    add = parser.add_argument
    add("--frames", type=parse_positive, help="number of frames (default: all)")
    add("--downscale", type=parse_positive, default=1, help="downscale pictures by this factor")
    add(
        "--held-out",
        action="append",
        default=[],
        metavar="NAME",
        help="name of a held-out camera; may be repeated (default: the first camera)",
    )


def add_study_options(parser: argparse.ArgumentParser) -> None:
    """Add the options of studies: `--lpips`, and those from which `make_pool` makes the pool."""
    add = parser.add_argument
    add("--lpips", type=Path, metavar="WEIGHTS", help="file with the state_dict of LPIPS (VGG16)")
    add(
        "--device",
        choices=("auto", "cpu", "cuda"),
        default="cpu",
        help="device of the training (default: %(default)s)",
    )
    add("--workers", type=int, default=1, help="number of parallel encodes (default: %(default)s)")
    add("--threads", type=int, default=1, help="threads per encode (default: %(default)s)")
    add("--ray", metavar="ADDRESS", help="run on a Ray cluster: HOST:PORT, auto or local")


def split_names(text: str) -> list[str]:
    """Return the different names in a comma-separated list."""
    return list(dict.fromkeys(name for name in text.split(",") if name))


def make_pool(options: argparse.Namespace) -> WorkerPool:
    """Return the pool described by `--workers`, `--threads`, `--ray` and `--device`.

    On a cluster, a job on CUDA occupies a GPU; Ray hides all GPUs from other jobs.

    Raises:
        ValueError: A number is out of range.
    """
    gpus = 1.0 if options.device == "cuda" else 0.0
    return WorkerPool(options.workers, options.threads, options.ray, gpus)
