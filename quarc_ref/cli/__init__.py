"""The `quarc-ref` command: options, paths, output and exit codes, but no processing."""
