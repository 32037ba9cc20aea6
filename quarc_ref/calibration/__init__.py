"""From videos without poses to a capture: `calibrate` finds offsets, lenses, poses and points."""
