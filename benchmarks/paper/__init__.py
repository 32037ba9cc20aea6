"""The paper's experiments on any capture: the code of `benchmarks/paper.py`.

experiments ──> trials ──> rows, one JSON file to each (run_trial)
                              │
                              └──> tables, plots, claims, one page (results)
"""
