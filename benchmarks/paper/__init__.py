"""The paper's experiments on any capture: what `benchmarks/paper.py` runs.

experiments ──> trials ──> rows, one JSON file to each (run_trial)
                              │
                              └──> tables, plots, claims, one page (results)
"""
