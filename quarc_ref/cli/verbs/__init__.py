"""The subcommands of `quarc-ref`, one module for each or for a few similar ones."""
