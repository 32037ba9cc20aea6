"""Cameras that move while a stream plays: orbits, spirals, tours, and keyframes of a file."""
