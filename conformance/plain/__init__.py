"""The text once more, in plain integers: what makes the vectors.

It shares no line with the package that it tests. It is slow, and meant to be read beside SPEC.
"""
