"""Gaussians to pictures, with gradients and without."""
