"""Streams damaged at random, and what decoding them costs: what `benchmarks/hostile.py` runs.

mutations ──> judge, one stream ──> blocks of them, kept (command)
"""
