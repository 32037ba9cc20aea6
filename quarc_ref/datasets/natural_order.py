"""Natural sort order, in which digits compare as numbers."""

import re


def natural_order(name: str) -> list[str | tuple[int, str]]:
    """Return a sort key by which `cam_2` comes before `cam_10`."""
    parts = re.split(r"0*([0-9]+)", name)
    # Numbers are compared by their digits, because `int` rejects thousands of them.
    return [(len(part), part) if index % 2 else part for index, part in enumerate(parts)]
