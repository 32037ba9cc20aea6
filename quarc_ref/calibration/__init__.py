"""Camera calibration: estimates time offsets, lenses, poses and points from videos."""
