"""Implements `benchmarks/paper.py`: the experiments of the QuARC-GS paper on any capture.

experiments ──> trials ──> rows, each in a JSON file (make_row)
                              │
                              └──> tables, plots, claims, one page (results)
"""
