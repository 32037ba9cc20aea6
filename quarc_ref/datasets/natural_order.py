"""Natural sort order of names, in which groups of digits are compared as numbers."""

import re


def natural_order(name: str) -> list[str | tuple[int, str]]:
    """Return a sort key that orders `cam_2` before `cam_10`."""
    parts = re.split(r"0*([0-9]+)", name)
    # Numbers are compared as strings, because `int` rejects numbers with thousands of digits.
    return [(len(part), part) if index % 2 else part for index, part in enumerate(parts)]
