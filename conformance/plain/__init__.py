"""A second implementation of SPEC.md in plain Python integers, which generates the vectors.

It shares no code with quarc_ref, which it tests. It is slow, and is meant to be read side by side
with SPEC.md.
"""
