"""Generates streams with hostile values: correctly coded records that no encoder would write.

Everything except the faults is correct, including CRCs, sequence numbers, INDX and TAIL, so that
decoders reach the faults.
"""
