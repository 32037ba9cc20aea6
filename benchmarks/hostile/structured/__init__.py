"""Generates streams with hostile values: records that no encoder writes, but correctly coded.

Everything except the fault is correct, including CRCs, sequence numbers, INDX and TAIL, so that
decoders reach the fault.
"""
