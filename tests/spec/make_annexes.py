"""Regenerates the generated regions of SPEC.md, and its dumps.

    PYTHONPATH=conformance python -m tests.spec.make_annexes

The output follows only from hand-made records and the syntax tables of the text, so that two runs
give the same bytes. Run it after a change of the format, and review the difference before
committing it.
"""

from functools import cache

from plain import spec_text
from plain.decoder import PlainStream, decode_plain
from tests.spec import annex_examples, annex_pages, annex_widths, vector_tables
from tests.spec.annex_stream_c import make_deep
from tests.spec.annex_stream_d import make_changing
from tests.spec.annex_streams import make_moving, make_still

# Frames whose planes are shown; the planes of other frames show no further feature.
_WITH_PLANES = ("A", "B", "C1001", "D11", "D12", "D13", "D14")


@cache
def streams() -> dict[str, bytes]:
    makers = {"A": make_still, "B": make_moving, "C": make_deep, "D": make_changing}
    return {name: make().data for name, make in makers.items()}


def make_regions(spec: str) -> dict[str, str]:
    """Return the text of every generated region.

    Args:
        spec: Text whose syntax tables name the fields of the streams.
    """
    regions = {
        "overview": annex_examples.overview(),
        "widths": annex_widths.widths(),
        "codes": vector_tables.codes_table(),
        "coder-steps": annex_examples.coder_steps(),
        "sampler": annex_examples.sampler(),
        "planes": annex_examples.planes(),
    }
    for table in vector_tables.TABLES:
        regions[f"vectors-{table.marker}"] = table.render()
    for name, data in streams().items():
        regions[f"stream-{name}"] = make_page(name, data, decode_plain(spec, data))
    return {name: f"\n{body}\n" for name, body in regions.items()}


def make_page(name: str, data: bytes, stream: PlainStream) -> str:
    parts = [
        annex_pages.introduction(data, spec_text.make_dump_path(name)),
        "The frames:\n\n" + annex_pages.digests(stream, name),
        "The fields:\n\n" + annex_pages.fields(stream, name),
    ]
    for frame in stream.frames:
        marker = f"{name}{frame.state.frame}"
        frame_name = f"frame {frame.state.frame} ({frame.kind})"
        title = f"Values decoded from {frame_name}"
        if marker.startswith(_WITH_PLANES):
            parts.append(
                f"Planes of {frame_name}, in coding order:\n\n{annex_pages.planes(frame, marker)}"
            )
        parts += [
            f"{title}, and values derived from its state:\n\n{annex_pages.notes(frame, marker)}",
            "Its state:\n\n" + annex_pages.states(frame, marker),
        ]
    return "\n".join(parts)


def main() -> None:
    spec = spec_text.SPEC.read_text("utf-8")
    for name, body in make_regions(spec).items():
        spec = spec_text.replace_region(spec, name, body)
    spec_text.SPEC.write_text(spec, "utf-8")
    for name, data in streams().items():
        (spec_text.ROOT / spec_text.make_dump_path(name)).write_text(
            annex_pages.dump(data), "utf-8"
        )


if __name__ == "__main__":
    main()
