"""Composes an HTML page of all experiments, with embedded plots."""

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from paper.experiments import Experiment
from paper.tables import format_html, format_stages
from quarc_ref.evaluation.pages import embed_png, fill_page, format_lines
from rate.claims import Claim
from studies import Row

_TEMPLATE = Path(__file__).with_name("page.html")
_HOLDS_TEXTS = {True: "yes", False: "<b>no</b>", None: "not measured"}


@dataclass(frozen=True, slots=True)
class Section:
    """The section of an experiment on the page.

    Attributes:
        experiment: The experiment.
        rows: Rows of the completed trials, in the order of the experiment.
        plots: Plots as PNG data, by file name.
    """

    experiment: Experiment
    rows: list[Row]
    plots: dict[str, bytes]


def compose_page(title: str, sections: Sequence[Section], claims: Sequence[Claim]) -> bytes:
    """Return the page as HTML.

    Args:
        title: Heading of the page.
        sections: Sections of the experiments; at least one of them has a row.
        claims: Claims of the paper, with the measured values.
    """
    rows = list({row["name"]: row for section in sections for row in section.rows}.values())
    page_fields = {
        "title": html.escape(title),
        "subtitle": html.escape(_describe_protocol(rows[0])),
        "claims": _compose_claims(claims),
        "sections": "".join(_compose_section(section) for section in sections if section.rows),
        "stages": format_stages(rows),
        "protocol": format_lines(rows[0]["protocol"]),
    }
    return fill_page(_TEMPLATE.read_text("utf-8"), page_fields)


def _describe_protocol(row: Row) -> str:
    protocol = row["protocol"]
    held_out = ", ".join(protocol["cameras"]["held_out"])
    return (
        f"Quality is measured on decoded files, for cameras held out from training ({held_out}). "
        f"{row['frames']} frames of {protocol['resolution'][0]} x {protocol['resolution'][1]}, "
        f"seed {row['seed']}, trained with {row['renderer']['training']}. A KB is 1024 bytes. "
        "Sizes per frame are means over the frames after the canonical frame; the estimate is the "
        "paper's, for the same symbols. The moving PSNR is measured on pixels that change from the "
        "previous frame. The slope is that of a line fitted to the PSNR of all frames."
    )


def _compose_section(section: Section) -> str:
    title = html.escape(section.experiment.title)
    figures = "".join(
        f'<figure><img alt="{title}" src="{embed_png(png)}"></figure>'
        for png in section.plots.values()
    )
    remark = section.experiment.remark
    return (
        f"<h2>{title}</h2>"
        + (f'<p class="soft">{html.escape(remark)}</p>' if remark else "")
        + f'<div class="wide">{format_html(section.rows)}</div>{figures}'
    )


def _compose_claims(claims: Sequence[Claim]) -> str:
    lines = ["<tr><th>claim</th><th>measured</th><th>limit</th><th>holds</th></tr>"]
    for claim in claims:
        claim_json = claim.as_json()
        value_text = "" if claim.value is None else f"{claim.value:.3f}"
        cells = (
            html.escape(claim.name),
            value_text,
            claim_json["asked"],
            _HOLDS_TEXTS[claim.holds],
        )
        lines.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
    return f"<table>{''.join(lines)}</table>"
