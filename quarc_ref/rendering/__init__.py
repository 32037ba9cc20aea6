"""Renders Gaussians, with or without gradients."""
