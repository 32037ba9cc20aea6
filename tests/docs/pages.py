"""Pages for readers, and the commands and programs in them."""

import re
import textwrap
from pathlib import Path

ROOT = Path(__file__).parents[2]
GUIDES = ROOT / "docs" / "guides"
FENCE = re.compile(r"^ *```(\w+)\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)


def find_fences(page: Path, language: str = "sh") -> list[str]:
    """Return the fences of a page in a language, by default the shell, in order."""
    fences = FENCE.findall(page.read_text("utf-8"))
    return [textwrap.dedent(text) for name, text in fences if name == language]
