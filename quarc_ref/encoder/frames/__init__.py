"""Trains the frames between keyframes: motion, updates, births and rate control."""
