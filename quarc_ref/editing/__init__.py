"""Streams to streams: cut and joined at canonical frames, without decoding a Gaussian."""
