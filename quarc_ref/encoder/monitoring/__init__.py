"""Reports of a running encode: every training step, every frame, and how long is left."""
