"""Compares streams and other methods on the same cameras and frames.

open_entry ──> Entry, one for each argument: a stream, PLY files, renders, a .4dgs file
entries ──> measure_entries, frame by frame ──> Measured, one for each entry
measured ──> summarize: operating points, paired differences, BD-rate ──> tables, page
"""
