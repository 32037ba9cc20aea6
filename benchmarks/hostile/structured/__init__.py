"""Generates streams with hostile values: records that no encoder writes, correctly coded.

CRCs, sequence numbers, INDX and TAIL are correct unless they are the fault, so that decoders reach
the fault.
"""
