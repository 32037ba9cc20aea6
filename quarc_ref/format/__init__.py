"""Converts bytes to records and symbols, and back: SPEC 5 and 8."""
