"""Loads captures, which are calibrated multi-view videos in common folder layouts."""
