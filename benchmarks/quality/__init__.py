"""The code of `benchmarks/quality.py`, which runs a study of picture quality.

study_captures ──> tasks ──> rows, each in a JSON file (make_row)
                                │
                                └──> statistics over seeds ──> tables, CSV, JSON, plot (results)
                                            │
                                            └──> differences of two studies (comparison)
"""
