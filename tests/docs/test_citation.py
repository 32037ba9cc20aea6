"""CITATION.cff names this version of the package, and the paper."""

from quarc_ref import __version__
from tests.docs.pages import ROOT

CITATION = (ROOT / "CITATION.cff").read_text("utf-8")


def test_the_cited_version_is_that_of_the_package():
    assert f"\nversion: {__version__}\n" in CITATION


def test_the_cited_paper_is_the_one_of_the_readme_and_the_specification():
    (title,) = [line.strip() for line in CITATION.splitlines() if "QuARC-GS: Quantized" in line]
    specification = " ".join((ROOT / "SPEC.md").read_text("utf-8").split())

    assert "https://arxiv.org/abs/2608.18285" in (ROOT / "README.md").read_text("utf-8")
    assert title.removeprefix('title: "').removesuffix('"') in specification
