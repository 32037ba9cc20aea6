"""Command-line options that several benchmarks share."""

import argparse


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
    add("--frames", type=int, help="number of frames (default: all)")
    add("--downscale", type=int, default=1, help="downscale pictures by this factor")
    add(
        "--held-out",
        action="append",
        default=[],
        metavar="NAME",
        help="name of a held-out camera; may be repeated (default: the first camera)",
    )
