"""The subcommands of `quarc-ref`; each module contains one command or a few similar ones."""
