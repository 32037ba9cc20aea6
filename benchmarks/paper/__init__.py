"""The paper's experiments on any capture: the code of `benchmarks/paper.py`.

experiments ──> trials ──> rows, each in a JSON file (make_row)
                              │
                              └──> tables, plots, claims, one page (results)
"""
