"""Generates hostile streams: records with values that no encoder writes, coded correctly.

CRCs, numbers, index and totals are correct unless the fault is in them, so that decoders reach the
fault.
"""
