import pytest

from quarc_ref.cli.columns import COMPARE_COLUMNS, EVAL_COLUMNS, INFO_ROWS
from quarc_ref.cli.verbs.stream import describe_stream
from quarc_ref.evaluation.comparison.tables import COMPARE_METRIC_COLUMNS, POINT_HEADINGS
from quarc_ref.evaluation.quality import EVAL_METRIC_COLUMNS
from quarc_ref.inspection.inspect_stream import inspect_stream
from quarc_ref.inspection.stream_summary import KINDS
from tests.cli.commands import run
from tests.docs.pages import GUIDES


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
    ("verb", "explanations"),
    [("eval", EVAL_COLUMNS), ("compare", COMPARE_COLUMNS), ("info", INFO_ROWS)],
)
def test_help_has_a_line_for_each(verb, explanations):
    help_text = " ".join(run(verb, "--help").stdout.split())

    for name, explanation in explanations.items():
        assert f"{name}: {explanation}" in help_text


@pytest.mark.parametrize("explanations", [EVAL_COLUMNS, COMPARE_COLUMNS])
def test_the_guide_has_a_line_for_each(explanations):
    text = (GUIDES / "comparing.md").read_text("utf-8")

    for name in _split_names(explanations):
        assert f"`{name}`" in text
