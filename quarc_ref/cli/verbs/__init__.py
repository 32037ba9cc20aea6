"""The subcommands of `quarc-ref`: a module has one command, or a few similar ones."""
