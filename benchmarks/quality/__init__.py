"""The protocol of picture quality: the code of `benchmarks/quality.py`.

subjects ──> tasks ──> rows, one JSON file to each (make_row)
                          │
                          └──> spreads over seeds ──> tables, CSV, JSON, plot (results)
                                      │
                                      └──> differences of two studies (comparison)
"""
