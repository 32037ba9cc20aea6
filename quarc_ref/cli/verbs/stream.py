"""The `info` and `verify` commands: `info` summarizes a stream, `verify` checks it."""

from contextlib import ExitStack
from typing import TYPE_CHECKING, Annotated

import typer

from quarc_ref.cli.errors import report_errors
from quarc_ref.cli.following import (
    DEFAULT_PATIENCE,
    FollowedStreamName,
    FollowFlag,
    Patience,
    make_follow_options,
)
from quarc_ref.cli.options import AsJson, Quiet, StreamName, format_stream_name
from quarc_ref.cli.output import TerminalProgress, print_fields, print_json
from quarc_ref.cli.seekable_stream import open_seekable
from quarc_ref.format.errors import BitstreamError
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.inspection.stream_summary import StreamSummary
    from quarc_ref.inspection.verify_stream import Verification
    from quarc_ref.streams import Follow, Source


def info(file: StreamName, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """Summarize a stream: counts, bytes by kind, and a zero-order estimate of these bytes."""
    with report_errors():
        from quarc_ref.inspection.inspect_stream import inspect_stream
        from quarc_ref.streams import open_source

        with TerminalProgress(quiet=quiet) as progress, open_source(file) as source:
            summary = inspect_stream(source, progress.advance)
        if as_json:
            print_json("info/3", summary.as_json())
        else:
            print_fields(format_stream_name(file), describe_stream(summary))


def verify(
    file: FollowedStreamName,
    deep: Annotated[
        bool,
        typer.Option(
            "--deep",
            help="Also check that both entropy decoders agree, and that decoding from every seek "
            "point gives the same states. Also print the stream's largest values and the limits of "
            "its conformance level.",
        ),
    ] = False,
    follow: FollowFlag = False,
    patience: Patience = DEFAULT_PATIENCE,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Decode a whole stream, and check every CRC and every state."""
    follow_options = make_follow_options(file, patience, follow=follow)
    with report_errors(), TerminalProgress(quiet=quiet) as progress, ExitStack() as stack:
        from quarc_ref.streams import open_source

        source = stack.enter_context(open_source(file, follow_options))
        verifier, verification = _Verifier(progress), None
        try:
            if deep:
                verification = verifier.verify(source, follow_options)
            else:
                verifier.decode(source, follow_options)
        except BitstreamError as error:
            if as_json:
                rejection = {
                    "valid": False,
                    "frames": verifier.frame_count,
                    "refused": error.reject_id,
                }
                print_json("verify/2", rejection)
            raise
        if as_json:
            deep_values = {"deep": verification.as_json()} if verification else {}
            result_values = {
                "valid": True,
                "frames": verifier.frame_count,
                "state_sha256": verifier.digest,
            }
            print_json("verify/2", {**result_values, **deep_values})
        else:
            fields = {"valid": "yes", "frames": f"{verifier.frame_count}"}
            fields |= {"last state": verifier.digest} if verifier.digest else {}
            print_fields(
                format_stream_name(file),
                fields | (describe_verification(verification) if verification else {}),
            )


class _Verifier:
    """Runs the checks of `verify`, and stores their results.

    Attributes:
        frame_count: Number of decoded frames.
        digest: Digest of the last decoded state; None before the first frame.
    """

    def __init__(self, progress: TerminalProgress) -> None:
        self.frame_count = 0
        self.digest: str | None = None
        self._progress = progress

    def decode(self, source: "Source", follow: "Follow | None") -> None:
        """Decode every frame."""
        from quarc_ref.decoder import compute_digest
        from quarc_ref.inspection.inspect_stream import count_frames
        from quarc_ref.streams import decode

        total = 0 if follow else count_frames(source)
        for scene in decode(source, follow=follow):
            self.digest = compute_digest(scene)
            self._record_progress("decode", self.frame_count + 1, total)

    def verify(self, source: "Source", follow: "Follow | None") -> "Verification":
        """Decode every frame, and run the checks of `--deep`."""
        from quarc_ref.inspection.verify_stream import verify_stream

        with open_seekable(source) as seekable_source:
            verification = verify_stream(seekable_source, self._record_progress, follow)
        self.digest = verification.sha256
        return verification

    def _record_progress(self, stage: str, done: int, total: int) -> None:
        if stage == "decode":
            self.frame_count = done
        self._progress.advance(stage, done, total)


def describe_verification(verification: "Verification") -> dict[str, str]:
    """Format the results of `verify --deep` as rows of a table."""
    bits = f"{verification.bits:,} bits in {verification.sections:,} sections"
    entropy_text = f"both decoders give the same {bits}"
    if verification.entropy_decoders == 1:
        entropy_text = f"one decoder gives {bits}; the other one, constriction, is not installed"
    level_text = "; ".join(
        f"{verification.maxima[key]:,} of {verification.limits[key]:,} {name}"
        for key, name in _LIMIT_NAMES.items()
    )
    return {
        "chunks": f"{verification.chunks:,}, all CRCs match",
        "states": f"{verification.frames:,}, all CRCs match",
        "entropy": entropy_text,
        "seek points": f"{verification.seek_points:,}, all with the same states "
        f"({format_count(verification.frames_compared, 'frame')} compared)",
        f"level {verification.level / 10:.1f}": f"within its limits; largest values: {level_text}",
    }


def describe_stream(summary: "StreamSummary") -> dict[str, str]:
    """Format a summary of a stream as rows of a table."""
    from quarc_ref.inspection.stream_summary import KINDS

    coded, estimate = summary.coded_bytes(), summary.estimate_bytes()
    kilobytes, header = summary.kilobytes_per_frame(), summary.header
    fields = {
        "format": f"{summary.format_version}, conformance level {header.level / 10:.1f}",
        "frames": f"{_format_frame_range(summary)} at {header.frames_per_second:g} per second",
        "Gaussians": f"{summary.gaussian_count:,}, SH degree {header.sh_degree}",
        "anchors": f"{summary.anchor_count:,} on {format_count(header.level_count, 'level')}, "
        f"resampled every {_format_interval(header.resample_interval)}",
        "whole stream": f"{coded['total']:,} bytes",
    }
    for kind in KINDS:
        fields[kind] = f"{coded[kind]:,} bytes (zero-order estimate {estimate[kind]:,})"
    fields["overhead"] = f"{coded['overhead']:,} bytes"
    means = {
        "without keyframes": kilobytes["without_canonical"],  # 0 if all frames are keyframes
        "for the whole stream": kilobytes["with_canonical"],
    }
    texts = [f"{mean:.2f} {name}" for name, mean in means.items() if mean]
    fields["KB per frame"] = f"{', '.join(texts)}; a KB is 1024 bytes"
    # binary32, of which seven digits are exact
    scale = f"{header.meters_per_unit:.7g}" if header.meters_per_unit else "unknown"
    fields["world"] = (
        f"{'right' if header.right_handed else 'left'}-handed, up {header.up or 'unknown'}, "
        f"{scale} meters per unit"
    )
    names = [f"{it.name} (held out)" if it.held_out else it.name for it in summary.cameras]
    fields["cameras"] = ", ".join(names) or "none"
    other_keys = summary.metadata.keys() - fields.keys() - {"settings"}
    return fields | {key: text for key, text in summary.metadata.items() if key in other_keys}


def _format_frame_range(summary: "StreamSummary") -> str:
    """Format the number of frames, and their range if the stream was cut."""
    frames = summary.frames
    if not frames or frames[0].frame == 0:
        return f"{len(frames)}"
    if len(frames) == 1:
        return f"1, frame {frames[0].frame},"
    return f"{len(frames)}, {frames[0].frame} to {frames[-1].frame},"


def _format_interval(count: int) -> str:
    return "frame" if count == 1 else f"{count} frames"


_LIMIT_NAMES = {
    "gaussians": "Gaussians",
    "births": "births in a frame",
    "chunk_bytes": "bytes in a payload",
}
