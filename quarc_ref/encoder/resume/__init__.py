"""Resumes an interrupted encode from a checkpoint or a partial stream."""
