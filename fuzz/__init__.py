"""Fuzzes everything that takes bytes; see `python -m fuzz`."""
