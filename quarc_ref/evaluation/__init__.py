"""Measures the quality of decoded streams: metrics, sizes and reports."""
