"""Fuzzes all functions that read bytes of files; see `fuzz.__main__`."""
