"""The command line of `quarc-ref`: options, paths, output and exit codes."""
