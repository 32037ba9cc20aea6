"""COVERAGE.md: which vectors test which clause of SPEC.md, and why some have none."""

from collections.abc import Iterable, Sequence

from making.unit_answers import Unit
from making.vectors import Vector
from plain import spec_text
from plain.clauses import Clause, clauses

REASONS: dict[str, str] = {
    "1-4": "binds encoders: `run.py --encoder` asks whether what they write is decoded",
    "7.6-5": "a stream that reaches id 2^32 has at least 2^32 births",
}
_SHOWN = 6
_HEAD = """# Which vectors test which clause

Made by `generate.py`. A clause of [SPEC.md](../SPEC.md) is a sentence with MUST; vectors are named
as in `manifest.json`. A vector of a clause would be answered otherwise by a decoder that takes no
notice of it, or takes it to say something else.

| clause | it says | vectors |
|---|---|---|
"""


def write_coverage(vectors: Iterable[Vector], units: Iterable[Unit]) -> bytes:
    """Return the page.

    Raises:
        ValueError: A clause has neither a vector nor a reason, or a vector names no clause.
    """
    named: dict[str, list[str]] = {}
    for vector in vectors:
        for number in vector.clauses:
            named.setdefault(number, []).append(vector.name)
    for unit in units:
        for number in unit.clauses.split():
            named.setdefault(number, []).append(f"unit/{unit.function}")
    spec = spec_text.text()
    known = clauses(spec)
    _check(named, known, spec_text.sections(spec))
    rows = [_row(clause, named.get(clause.number, [])) for clause in known]
    sections = [
        f"| {name} | {_list(named[name])} |"
        for name in sorted(set(named) & spec_text.sections(spec))
    ]
    rest = "\nSections, beside their clauses:\n\n| section | vectors |\n|---|---|\n"
    return (_HEAD + "\n".join(rows) + "\n" + rest + "\n".join(sections) + "\n").encode()


def _check(named: dict[str, list[str]], known: Sequence[Clause], sections: set[str]) -> None:
    numbers = {clause.number for clause in known}
    unknown = set(named) - numbers - sections
    bare = numbers - set(named) - REASONS.keys()
    idle = set(REASONS) - numbers
    if unknown or bare or idle:
        message = (
            f"no such clause: {unknown}; without a vector: {sorted(bare)}; no reason needed: {idle}"
        )
        raise ValueError(message)


def _row(clause: Clause, vectors: list[str]) -> str:
    text = " ".join(clause.text.lstrip("- ").split()).removesuffix(" [").replace("|", "\\|")
    return f"| {clause.number} | {text} | {_list(vectors) or REASONS[clause.number]} |"


def _list(vectors: list[str]) -> str:
    shown = ", ".join(f"`{name}`" for name in vectors[:_SHOWN])
    more = len(vectors) - _SHOWN
    return shown + (f" and {more} more" if more > 0 else "")
