"""The `quarc-ref` command: paths, options, exit codes; what it does is done elsewhere."""
