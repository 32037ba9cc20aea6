"""Inspects streams: summaries, chunks, symbols, verification, decoding speed."""
