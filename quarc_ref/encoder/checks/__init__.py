"""Checks that find faults of a capture before hours of training are spent on it."""
