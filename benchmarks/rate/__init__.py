"""Comparison of size and quality with other formats: the code of `benchmarks/rate.py`.

jobs ──> streams, each in a file (measure)
            │
            ├──> rows: planes of symbols, converters, keyframe_deltas
            ├──> points of a sweep, and their hull
            └──> claims ──> tables, CSV, plots (results)
"""
