"""Compares streams and other methods on the same cameras and frames.

open_entries ──> Entry, one per argument: a stream, PLY files, renders, or a .4dgs file
Entry ──> measure_entries, frame by frame ──> MeasuredEntry, one per entry
MeasuredEntry ──> summarize: operating points, paired differences, BD-rate ──> tables, page
"""
