"""Pages for readers, and the commands in them."""

import re
import textwrap
from pathlib import Path

ROOT = Path(__file__).parents[2]
GUIDES = ROOT / "docs" / "guides"
FENCE = re.compile(r"^( *)```sh\n(.*?)^ *```$", re.MULTILINE | re.DOTALL)


def find_fences(page: Path) -> list[str]:
    """Return the shell fences of a page in order."""
    return [textwrap.dedent(fence) for _, fence in FENCE.findall(page.read_text("utf-8"))]
