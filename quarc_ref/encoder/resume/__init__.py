"""Resuming an interrupted encode: checkpoints and partial streams."""
