"""Layouts of captures: a loader to a file, a row to a loader in `table`."""
