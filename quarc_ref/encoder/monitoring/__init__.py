"""Reports from a running encode: training steps, frames and the remaining time."""
