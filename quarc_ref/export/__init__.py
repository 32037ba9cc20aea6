"""Decoded frames as files that other programs read."""
