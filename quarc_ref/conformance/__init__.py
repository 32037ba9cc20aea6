"""The decoder as conformance/run.py calls it."""
