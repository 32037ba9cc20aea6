"""Trains Gaussians: losses, views, density control and frame 0."""
