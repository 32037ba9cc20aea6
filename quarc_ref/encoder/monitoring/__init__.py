"""Reports the progress of an encode: training steps, frames and the remaining time."""
