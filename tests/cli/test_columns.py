import pytest

from quarc_ref.cli.columns import COMPARE_COLUMNS, EVAL_COLUMNS, INFO_ROWS
from quarc_ref.cli.verbs.stream import describe_stream
from quarc_ref.evaluation.comparison.tables import COMPARE_METRIC_COLUMNS, POINT_HEADINGS
from quarc_ref.evaluation.quality import EVAL_METRIC_COLUMNS
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import KINDS
from tests.cli.commands import run
from tests.docs.pages import ROOT


def _split_names(explanations):
    return {name for names in explanations for name in names.split(", ")}


def test_every_column_of_eval_and_compare_is_explained():
    assert {heading for heading, _, _ in EVAL_METRIC_COLUMNS} <= _split_names(EVAL_COLUMNS)
    headings = {heading for heading, _, _ in COMPARE_METRIC_COLUMNS} | set(POINT_HEADINGS)
    assert headings <= _split_names(COMPARE_COLUMNS)


def test_every_kind_of_bytes_that_info_prints_is_explained(stream_file):
    rows = describe_stream(inspect_stream(stream_file.read_bytes()))

    assert set(KINDS) | {"anchors", "overhead", "KB per frame"} <= _split_names(INFO_ROWS) & set(
        rows
    )


@pytest.mark.parametrize(
    ("verb", "explanations", "guide"),
    [
        ("eval", EVAL_COLUMNS, "comparing"),
        ("compare", COMPARE_COLUMNS, "comparing"),
        ("info", INFO_ROWS, "streams"),
    ],
)
def test_help_and_guide_have_a_line_for_each(verb, explanations, guide):
    help_text = " ".join(run(verb, "--help").stdout.split())
    text = (ROOT / "docs" / "guides" / f"{guide}.md").read_text("utf-8")

    for name, explanation in explanations.items():
        assert f"{name}: {explanation}" in help_text
        assert all(f"`{row_name}`" in text for row_name in name.split(", ")), name
