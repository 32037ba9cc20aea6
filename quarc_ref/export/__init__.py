"""Exports decoded frames to file formats of other programs, and imports Gaussians from them."""
