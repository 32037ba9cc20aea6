"""Entropy coding of planes of symbols: SPEC 8."""
