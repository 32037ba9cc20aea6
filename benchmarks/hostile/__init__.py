"""Mutated streams and the cost of decoding them: the code of `benchmarks/hostile.py`.

mutations ──> judge, one stream ──> blocks of them, kept (command)
"""
