"""The steps of `benchmarks/gpu.py`; the module of each step has a function `run`."""
