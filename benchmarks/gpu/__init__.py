"""The steps of `benchmarks/gpu.py`. Each step is a module with a function `run`."""
