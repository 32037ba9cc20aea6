"""Entry point of `python -m quarc_ref`, which runs the `quarc-ref` command."""

from quarc_ref.cli.app import main

main()
