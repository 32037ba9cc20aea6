"""Mutates streams, and decodes them within limits: the code of `benchmarks/hostile.py`.

mutations (a mutant) ──> judge (its verdict) ──> blocks (tallies of mutants) ──> command
"""
