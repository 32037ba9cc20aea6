"""Options that several benchmarks share."""

import argparse


def add_set_option(parser: argparse.ArgumentParser) -> None:
    """Add `--set`, which changes settings of the preset; `args.set` is a list of KEY=VALUE."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="change a setting of the preset",
    )


def add_capture_options(parser: argparse.ArgumentParser) -> None:
    """Add `--frames`, `--downscale` and `--held-out`, which are options of reading a capture."""
    add = parser.add_argument
    add("--frames", type=int, help="number of frames; all by default")
    add("--downscale", type=int, default=1, help="downscale pictures by this factor")
    add(
        "--held-out",
        action="append",
        default=[],
        metavar="NAME",
        help="held-out camera; the first by default",
    )
