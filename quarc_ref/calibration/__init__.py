"""Camera calibration: finds time offsets, lenses, poses and points for videos without poses."""
