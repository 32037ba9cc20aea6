"""Formats a number with a noun, such as "3 frames", and names for plots and tables."""


def format_count(count: int, noun: str) -> str:
    """Format a number and a noun, which is in the plural unless the number is 1.

    Args:
        count: The number.
        noun: Singular of a noun with a plural in -s.
    """
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"


def replace_unprintable(text: str) -> str:
    """Replace control characters, and bytes of a file name that are no valid UTF-8, by `?`."""
    return "".join(character if character.isprintable() else "?" for character in text)
