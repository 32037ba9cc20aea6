"""The code of `benchmarks/hostile.py`: decodes mutated streams with limited time and memory.

mutations (a mutant) ──> judge (its verdict) ──> blocks (tallies of mutants) ──> command
"""
