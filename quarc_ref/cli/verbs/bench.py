"""The `bench` command: measures decoding speed on this machine."""

from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import UsageError, report_errors
from quarc_ref.cli.options import AsJson, Quiet, StreamName, format_stream_name
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.inspection.decode_speed import Speed


def bench(
    file: StreamName,
    threads: Annotated[
        int,
        typer.Option(
            "--threads",
            "-t",
            min=1,
            max=64,
            help="Number of decoding threads; 1 decodes without prefetching.",
        ),
    ] = 2,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Measure decoding speed: frames per second, time by stage, and memory."""
    with report_errors():
        from quarc_ref.inspection.decode_speed import measure_speed

        with TerminalProgress(quiet=quiet) as progress:
            speed = measure_speed(file, threads, progress.advance)
        if speed is None:
            message = "the stream has no frames to decode"
            raise UsageError(message)
        if as_json:
            print_json("bench/2", speed.as_json())
        else:
            print_fields(format_stream_name(file), _describe_speed(speed))


def _describe_speed(speed: "Speed") -> dict[str, str]:
    """Format a measured decoding speed as rows of a table."""
    warm_seconds = speed.warm_first_frame_s
    warm_text = "" if warm_seconds is None else f", {warm_seconds:.2f} s with all code loaded"
    memory = "unknown" if speed.peak_rss_mib is None else f"{speed.peak_rss_mib:.0f} MiB"
    rows = {
        "frames": f"{speed.frames:,}, the last with {format_count(speed.gaussians, 'Gaussian')}",
        "first frame": f"{speed.first_frame_s:.2f} s after opening{warm_text}",
        "peak memory": memory,
    }
    if speed.frames == 1:
        return rows | {"frames per second": "unknown, because the first frame is not counted"}
    return rows | _describe_later_frames(speed)


def _describe_later_frames(speed: "Speed") -> dict[str, str]:
    threads = format_count(speed.threads, "thread")
    stolen_share = speed.stolen_share
    stolen_text = (
        f"; {stolen_share:.0%} of the CPU time was taken by the host" if stolen_share else ""
    )
    return {
        "frames per second": f"{speed.fps:.1f}, {threads}, {speed.engine} engine",
        "processor": f"{speed.cpu_ms:.1f} ms per frame, all threads together{stolen_text}",
        **{
            f"ms: {stage}": f"{milliseconds:.2f}"
            for stage, milliseconds in speed.ms_by_stage.items()
        },
    }
