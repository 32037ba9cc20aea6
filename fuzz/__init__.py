"""Fuzzes the functions that parse files; see `fuzz.__main__`."""
