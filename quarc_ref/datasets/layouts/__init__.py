"""Layouts of captures: a loader per file, a row per loader in `table`."""
