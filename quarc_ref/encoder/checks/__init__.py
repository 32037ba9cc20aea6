"""Checks that find faults of a capture before hours are spent on training."""
