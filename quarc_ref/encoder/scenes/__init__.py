"""Encodes Gaussians that another method has trained, without pictures and without torch."""
