"""Loaders for the layouts of captures: one module per layout, listed in `table`."""
