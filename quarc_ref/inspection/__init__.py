"""Inspects streams: summary, chunks, symbols, verification, decoding speed."""
