"""Reports of a running encode: every training step, every frame, and the remaining time."""
