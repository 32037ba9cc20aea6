"""Trains Gaussians: losses, views, density control and the canonical frame."""
