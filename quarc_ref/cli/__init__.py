"""The `quarc-ref` command: options, paths, output and exit codes. The work is done elsewhere."""
