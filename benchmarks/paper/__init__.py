"""Implements `benchmarks/paper.py`, which runs the paper's experiments on any capture.

experiments ──> trials ──> rows, each in a JSON file (make_row)
                              │
                              └──> tables, plots, claims, one page (results)
"""
