"""Compares streams and other methods on the same cameras and frames.

`open_entries` opens an `Entry` for every argument: a stream, PLY files, renders or a `.4dgs`
file. `measure_entries` renders and measures the entries frame by frame, and returns a
`MeasuredEntry` for each. `summarize` computes operating points, paired differences and
BD-rate, which `tables` and `page` format.
"""
