"""The ladder of fields: the code of `benchmarks/ladder.py`.

stream ──> start (decoded frame T) ──> fit a rung (fitting) ──> floats ──────────┐
                                                                 │               ├──> judge
                                     decoder <── steps (rounding)┘──> rounded ───┘
                                                   │
                                                   └──> bytes

Each rung is saved as a JSON file (rows); the table contains the rungs that exist (tables).
"""
