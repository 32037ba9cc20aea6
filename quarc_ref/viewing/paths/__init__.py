"""Paths of moving cameras: orbits, spirals, tours, and keyframes from a file."""
