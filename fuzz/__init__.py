"""Fuzzing of everything that takes bytes; `python -m fuzz` says how."""
