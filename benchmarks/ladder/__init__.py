"""The ladder of fields: what `benchmarks/ladder.py` runs.

stream ──> start (decoded frame T) ──> fit a rung (fitting) ──> floats ──────────┐
                                                                 │               ├──> judge
                                     decoder <── steps (rounding)┘──> rounded ───┘
                                                   │
                                                   └──> bytes

A rung is a JSON file (rows); the table is made of those that are there (tables).
"""
