"""Checks of a capture before it is trained on."""
