"""A second implementation of SPEC in plain integers, which makes the vectors.

It shares no code with the package that it tests. It is slow, and meant to be read next to SPEC.
"""
