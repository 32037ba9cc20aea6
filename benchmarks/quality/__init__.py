"""The protocol of picture quality: what `benchmarks/quality.py` runs.

subjects ──> tasks ──> rows, one JSON file to each (make_row)
                          │
                          └──> spreads over seeds ──> tables, CSV, JSON, plot (results)
                                      │
                                      └──> differences of two studies (comparison)
"""
