"""Adapter through which conformance/run.py tests the decoder."""
