"""`python -m quarc_ref` is `quarc-ref`."""

from quarc_ref.cli.app import main

main()
