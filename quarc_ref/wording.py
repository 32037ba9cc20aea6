"""Formats counts such as "3 frames", names for plots and tables, and how to install an extra."""


def format_count(count: int, noun: str) -> str:
    """Format a number and a noun, which is in the plural unless the number is 1.

    Args:
        count: The number.
        noun: Singular of a noun with a plural in -s.
    """
    return f"{count:,} {noun}" if count == 1 else f"{count:,} {noun}s"


def suggest_install(extras: str) -> str:
    """Return how to install extras of the package, which are separated by commas.

    The package is not on PyPI, so pip needs the path of a clone or of a wheel: it would take the
    name of the package from anyone who registers it there.
    """
    return (
        f'install it with: pip install ".[{extras}]" in a clone of quarc-ref, or pip install '
        f'"FILE.whl[{extras}]" with the file of a wheel'
    )


def replace_unprintable(text: str) -> str:
    """Replace control characters, and bytes of a file name that are no valid UTF-8, by `?`."""
    return "".join(character if character.isprintable() else "?" for character in text)
