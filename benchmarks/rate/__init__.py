"""Implements `benchmarks/rate.py`, which compares streams with other formats.

jobs ──> streams, each in a file (measure)
            │
            ├──> rows: planes of symbols, converters, keyframe_deltas
            ├──> points of a sweep, and their hull
            └──> claims ──> tables, CSV, plots (results)
"""
