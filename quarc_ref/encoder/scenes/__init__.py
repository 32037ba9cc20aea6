"""Gaussians of other methods to a stream, without pictures: fitted, coded, verified; no torch."""
