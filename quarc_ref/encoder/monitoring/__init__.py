"""What an encode reports while it runs: every training step, every frame, and how long is left."""
