"""Captures: calibrated multi-view video as users have it on disk."""
