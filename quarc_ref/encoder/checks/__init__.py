"""Checks that find faults in a capture before hours are spent on training."""
