"""The code of `benchmarks/hostile.py`: mutates streams, and decodes them within limits.

mutations (a mutant) ──> judge (its verdict) ──> blocks (tallies of mutants) ──> command
"""
