"""Encodes Gaussians of other methods, without pictures and torch: fit, code, verify."""
