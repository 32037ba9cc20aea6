"""Inspects streams: summarizes and verifies them, and measures decoding speed."""
