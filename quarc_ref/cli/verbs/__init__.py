"""The subcommands of `quarc-ref`; a module contains one command, or a few similar commands."""
