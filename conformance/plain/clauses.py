"""Checks of the text itself: clauses and their ids, reject ids in clauses, links, references."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from plain import spec_text

_CODE_WORD = re.compile(r"\bMUST(?: NOT)?\b")
_CLAUSE_ID = re.compile(r"\[((?:\d+(?:\.\d+)?|[A-Z]\.\d+)-\d+)\]")
_TOKEN = re.compile(f"(?P<word>{_CODE_WORD.pattern})|{_CLAUSE_ID.pattern}")


@dataclass(frozen=True)
class Clause:
    """A sentence with MUST.

    Attributes:
        section: Section of the clause.
        number: Id in brackets.
        text: Text from the end of the previous clause in its block to the id.
    """

    section: str
    number: str
    text: str


def blocks(spec: str) -> Iterator[tuple[str, str]]:
    """Section and text of every paragraph and list item; no tables, code or headings."""
    section, lines, fenced = "", [], False
    for line in [*spec.splitlines(), ""]:
        fenced ^= line.startswith("```")
        heading = re.match(r"#{2,3} (?:Annex )?(\d+(?:\.\d+)?|[A-Z](?:\.\d+)?)[ :]", line)
        apart = (
            not line.strip() or heading or line.startswith(("|", "    ", "```", "<!--")) or fenced
        )
        if (apart or re.match(r"- |\d+\. ", line.lstrip())) and lines:
            yield section, " ".join(lines)
            lines = []
        if not apart:
            lines.append(line.strip())
        section = heading[1] if heading else section


def clauses(spec: str) -> list[Clause]:
    """All clauses; a MUST without an id, or an id without a MUST, is an AssertionError."""
    found = []
    for section, block in blocks(re.sub(r'"MUST(?: NOT)?"', "", spec)):
        begin, word = 0, None
        for token in _TOKEN.finditer(block):
            if token["word"]:
                assert word is None, f"{section}: two MUST before an id: {block}"
                word = token
                continue
            assert word is not None, f"{section}: {token[0]} without a MUST"
            between = block[word.end() : token.start()]
            assert not re.search(r"\w[.] [A-Z]", between), (
                f"{section}: {token[0]} is not in its sentence"
            )
            after = block[token.end() : token.end() + 2]
            assert after.strip() in {"", ".", ";"}, f"{section}: {token[0]} does not end a sentence"
            found.append(Clause(section, token[2], block[begin : token.start()]))
            begin, word = token.end(), None
        assert word is None, f"{section}: a MUST without an id: {block}"
    return found


def check_clause_ids(spec: str) -> None:
    counts: dict[str, int] = {}
    for clause in clauses(spec):
        counts[clause.section] = counts.get(clause.section, 0) + 1
        assert clause.number == f"{clause.section}-{counts[clause.section]}"


def check_reject_ids_of_clauses(spec: str) -> None:
    """Every id in a clause must be in the table, and every id in the table in a clause."""
    known = {row[0]: row[2] for row in spec_text.table(spec, "rejects")}
    named: dict[str, set[str]] = {name: set() for name in known}
    for clause in clauses(spec):
        for name in re.findall(r"\(`([a-z-]+)`[,)]|, `([a-z-]+)`\)", clause.text):
            named["".join(name)].add(clause.section)
    for name, sections in named.items():
        said = set(re.findall(r"\d+(?:\.\d+)?", known[name]))
        assert sections & said, f"{name}: no clause in {known[name]}, but in {sections}"


def check_links(spec: str) -> None:
    headings = re.findall(r"^#{1,4} (.+)$", spec, re.MULTILINE)
    anchors = [_anchor(heading) for heading in headings]
    assert len(set(anchors)) == len(anchors)
    links = re.findall(r"\]\(#([^)]+)\)", spec)
    assert set(links) <= set(anchors), set(links) - set(anchors)
    chapters = re.findall(r"^## (.+)$", spec, re.MULTILINE)
    assert {_anchor(chapter) for chapter in chapters} <= set(links)


def _anchor(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def check_references(spec: str) -> None:
    known = spec_text.sections(spec)
    numbers = r"(\d+(?:\.\d+)?(?:(?:, | to | and |, and )\d+(?:\.\d+)?)*)"
    own = re.sub(r"RFC \d+, section \d+", "", spec)
    said = re.findall(rf"\b[Ss]ections? {numbers}", own)
    said += re.findall(r"\((\d+\.\d+)\)", spec)
    wrong = set(re.findall(r"\d+(?:\.\d+)?", " ".join(said))) - known
    assert not wrong, wrong
    assert set(re.findall(r"\bAnnex ([A-Z](?:\.\d+)?)", spec)) <= known


CHECKS = (check_clause_ids, check_reject_ids_of_clauses, check_links, check_references)
