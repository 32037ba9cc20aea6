"""Loaders for capture layouts: one module per layout; the module `table` lists the layouts."""
