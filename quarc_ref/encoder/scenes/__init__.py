"""Gaussians of others to a stream, without pictures: fitted, coded, verified; no torch."""
