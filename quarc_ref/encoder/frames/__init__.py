"""Trains the frames after frame 0: motion, updates, births and rate control."""
