"""Numbers with nouns."""


def count_noun(count: int, noun: str) -> str:
    """Return a number and a noun, in the plural where the number takes it.

    Args:
        count: How many.
        noun: In the singular, of those that take an s.
    """
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"
