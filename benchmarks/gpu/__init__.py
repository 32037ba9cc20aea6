"""The steps of `benchmarks/gpu.py`, each in a module with the function `work`."""
