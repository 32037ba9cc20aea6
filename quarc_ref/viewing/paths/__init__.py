"""Paths of moving cameras: orbits, spirals, tours, and keyframes of a file."""
