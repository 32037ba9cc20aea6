"""Bytes and quality beside others: what `benchmarks/rate.py` runs.

jobs ──> streams, one file to each (measure)
            │
            ├──> rows: planes of symbols, converters, keyframe_deltas
            ├──> points of a sweep, and their hull
            └──> claims ──> tables, CSV, plots (results)
"""
