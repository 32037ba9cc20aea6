"""Runs the `quarc-ref` command by `python -m quarc_ref`."""

from quarc_ref.cli.app import main

main()
