"""Rate and quality compared with other formats: the code of `benchmarks/rate.py`.

jobs ──> streams, one file to each (measure)
            │
            ├──> rows: planes of symbols, converters, keyframe_deltas
            ├──> points of a sweep, and their hull
            └──> claims ──> tables, CSV, plots (results)
"""
