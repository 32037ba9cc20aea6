"""The figures at the top of README.md are those of benchmarks/README.md."""

import re

import pytest

from tests.docs.pages import ROOT

README = (ROOT / "README.md").read_text("utf-8")
BENCHMARKS = (ROOT / "benchmarks" / "README.md").read_text("utf-8")


def _find(pattern: str, text: str) -> float:
    (figure,) = re.findall(pattern, text, re.MULTILINE)
    return float(figure)


@pytest.mark.parametrize(
    ("headline", "measured"),
    [
        (r"^\| \*\*(\S+) dB\*\* \| PSNR", r"^\| frame 0, held-out .*\| (\S+) \| \S+ KB \|$"),
        (r"the first frame takes (\S+) KB", r"^\| frame 0, held-out .*\| (\S+) KB \|$"),
        (r"^\| \*\*(\S+) KB\*\* \| mean size", r"^\| format 1.1, training views .*\| (\S+) \|$"),
        (r"^\| \*\*(\S+) s\*\* \| encoding time", r"each later frame (\S+) s; with"),
        (r"the first frame takes (\S+) s\.", r"^(\S+) s, and each later frame"),
    ],
)  # fmt: skip
def test_a_headline_is_a_rounded_measurement(headline, measured):
    assert _find(headline, README) == pytest.approx(_find(measured, BENCHMARKS), abs=0.051)
