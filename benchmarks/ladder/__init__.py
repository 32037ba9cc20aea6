"""The code of `benchmarks/ladder.py`: fits a frame with different sets of free fields.

stream ──> start (decoded frame T) ──> fit a rung (fitting) ──> floats ──────────┐
                                                                 │               ├──> judge
                                     decoder <── steps (rounding)┘──> rounded ───┘
                                                   │
                                                   └──> bytes

The result of each rung is saved as a JSON file (rows); the table shows all saved results (tables).
"""
