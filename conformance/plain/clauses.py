"""Checks the text of SPEC.md: ids of clauses, reject ids, links, and references to sections."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from plain import spec_text

_MUST = re.compile(r"\bMUST(?: NOT)?\b")
_CLAUSE_ID = re.compile(r"\[((?:\d+(?:\.\d+)?|[A-Z]\.\d+)-\d+)\]")
_TOKEN = re.compile(f"(?P<word>{_MUST.pattern})|{_CLAUSE_ID.pattern}")


@dataclass(frozen=True)
class Clause:
    """A sentence of SPEC.md that contains MUST.

    Attributes:
        section: Number of the section that contains the clause.
        number: Id of the clause, which is in brackets at its end.
        text: Text from the end of the previous clause of the same paragraph or list item to the id.
    """

    section: str
    number: str
    text: str


def split_blocks(spec: str) -> Iterator[tuple[str, str]]:
    """Yield (section, text) of every paragraph and list item, without tables, code and headings."""
    section, lines, is_fenced = "", [], False
    for line in [*spec.splitlines(), ""]:
        is_fenced ^= line.startswith("```")
        heading = re.match(r"#{2,3} (?:Annex )?(\d+(?:\.\d+)?|[A-Z](?:\.\d+)?)[ :]", line)
        is_separator = (
            not line.strip()
            or heading
            or line.startswith(("|", "    ", "```", "<!--"))
            or is_fenced
        )
        if (is_separator or re.match(r"- |\d+\. ", line.lstrip())) and lines:
            yield section, " ".join(lines)
            lines = []
        if not is_separator:
            lines.append(line.strip())
        section = heading[1] if heading else section


def parse_clauses(spec: str) -> list[Clause]:
    """Return all clauses, after checking that each MUST has an id and each id a MUST."""
    parsed = []
    for section, block in split_blocks(re.sub(r'"MUST(?: NOT)?"', "", spec)):
        text_start, must_token = 0, None
        for token in _TOKEN.finditer(block):
            if token["word"]:
                assert must_token is None, f"{section}: two MUSTs precede one id: {block}"
                must_token = token
                continue
            assert must_token is not None, f"{section}: no MUST precedes {token[0]}"
            text_between = block[must_token.end() : token.start()]
            assert not re.search(r"\w[.] [A-Z]", text_between), (
                f"{section}: {token[0]} is not in the sentence with its MUST"
            )
            text_after_id = block[token.end() : token.end() + 2]
            assert text_after_id.strip() in {"", ".", ";"}, (
                f"{section}: {token[0]} is not at the end of a sentence"
            )
            parsed.append(Clause(section, token[2], block[text_start : token.start()]))
            text_start, must_token = token.end(), None
        assert must_token is None, f"{section}: no id follows a MUST: {block}"
    return parsed


def check_clause_ids(spec: str) -> None:
    counts: dict[str, int] = {}
    for clause in parse_clauses(spec):
        counts[clause.section] = counts.get(clause.section, 0) + 1
        assert clause.number == f"{clause.section}-{counts[clause.section]}"


def check_reject_ids_of_clauses(spec: str) -> None:
    """Check that each reject id occurs in a section that the table of reject ids lists for it."""
    table_sections = {row[0]: row[2] for row in spec_text.read_table(spec, "rejects")}
    clause_sections: dict[str, set[str]] = {name: set() for name in table_sections}
    for clause in parse_clauses(spec):
        for name in re.findall(r"\(`([a-z-]+)`[,)]|, `([a-z-]+)`\)", clause.text):
            clause_sections["".join(name)].add(clause.section)
    for name, sections in clause_sections.items():
        stated_sections = set(re.findall(r"\d+(?:\.\d+)?", table_sections[name]))
        assert sections & stated_sections, (
            f"{name}: the table lists {table_sections[name]}, but the clauses are in {sections}"
        )


def check_links(spec: str) -> None:
    headings = re.findall(r"^#{1,4} (.+)$", spec, re.MULTILINE)
    anchors = [_make_heading_anchor(heading) for heading in headings]
    assert len(set(anchors)) == len(anchors)
    links = re.findall(r"\]\(#([^)]+)\)", spec)
    assert set(links) <= set(anchors), set(links) - set(anchors)
    chapters = re.findall(r"^## (.+)$", spec, re.MULTILINE)
    assert {_make_heading_anchor(chapter) for chapter in chapters} <= set(links)


def _make_heading_anchor(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def check_references(spec: str) -> None:
    section_numbers = spec_text.list_section_numbers(spec)
    number_pattern = r"(\d+(?:\.\d+)?(?:(?:, | to | and |, and )\d+(?:\.\d+)?)*)"
    text_without_rfcs = re.sub(r"RFC \d+, section \d+", "", spec)
    references = re.findall(rf"\b[Ss]ections? {number_pattern}", text_without_rfcs)
    references += re.findall(r"\((\d+\.\d+)\)", spec)
    unknown = set(re.findall(r"\d+(?:\.\d+)?", " ".join(references))) - section_numbers
    assert not unknown, unknown
    assert set(re.findall(r"\bAnnex ([A-Z](?:\.\d+)?)", spec)) <= section_numbers


CHECKS = (check_clause_ids, check_reject_ids_of_clauses, check_links, check_references)
