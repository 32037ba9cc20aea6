"""Encodes Gaussians that another method has trained; needs neither pictures nor torch."""
