"""Commands in README.md and the guides exist, with all options that are shown."""

import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import pytest
import typer.main

from quarc_ref.cli.app import app
from tests.docs.pages import GUIDES, ROOT, find_fences

PAGES = [ROOT / "README.md", *sorted(GUIDES.glob("*.md"))]


def find_commands(page: Path) -> Iterator[list[str]]:
    """Yield the arguments of every `quarc-ref` command in the shell fences of a page."""
    for fence in find_fences(page):
        for line in fence.replace("\\\n", " ").splitlines():
            for command in " ".join(shlex.split(line, comments=True)).split(" | "):
                program, *arguments = command.split() or [""]
                if program == "quarc-ref":
                    yield arguments


def list_options(command) -> set[str]:
    """Return all spellings of a command's options."""
    spellings = (name for option in command.params for name in option.opts + option.secondary_opts)
    return {name for name in spellings if name.startswith("-")}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_and_their_options_exist(page):
    group = typer.main.get_command(app)
    for verb, *arguments in find_commands(page):
        if verb.startswith("-"):
            assert verb in list_options(group)
            continue
        options = {word.partition("=")[0] for word in arguments if re.match("--?[a-z]", word)}
        assert options <= list_options(group.commands[verb]), [verb, *arguments]


def test_commands_are_found():
    assert sum(1 for page in PAGES for _ in find_commands(page)) > 20


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page):
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text("utf-8")):
        assert (page.parent / target).exists(), target
