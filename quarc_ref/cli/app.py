"""The `quarc-ref` application: registers all commands, and handles `--version`.

Commands import heavy modules inside their functions, so that `--help` is fast and `info`, `verify`
and `decode` need neither torch nor OpenCV.
"""

import logging
from typing import Annotated

import typer

from quarc_ref import __version__
from quarc_ref.cli.columns import COMPARE_COLUMNS, EVAL_COLUMNS, INFO_ROWS, format_explanations
from quarc_ref.cli.command import Subcommand
from quarc_ref.cli.errors import ensure_standard_streams, report_failed_output
from quarc_ref.cli.output import MessageHandler
from quarc_ref.cli.verbs import (
    bench,
    calibrate,
    capture,
    compare,
    decode,
    doctor,
    edit,
    edit_scene,
    encode,
    evaluate,
    inspect,
    publish,
    render,
    scenes,
    stream,
    view,
)
from quarc_ref.format.constants import VERSION_MAJOR, VERSION_MINOR

app = typer.Typer(
    name="quarc-ref",
    help="Encode, decode and measure .quarc streams: free-viewpoint video as moving Gaussians.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("calibrate", cls=Subcommand)(calibrate.calibrate)
app.command("doctor", cls=Subcommand)(doctor.doctor)
app.command("encode", cls=Subcommand)(encode.encode)
app.command("import", cls=Subcommand)(scenes.import_frames)
app.command("decode", cls=Subcommand)(decode.decode_frames)
app.command("verify", cls=Subcommand)(stream.verify)
app.command("info", cls=Subcommand, epilog=format_explanations(INFO_ROWS))(stream.info)
app.command("inspect", cls=Subcommand)(inspect.inspect)
app.command("cut", cls=Subcommand)(edit.cut)
app.command("join", cls=Subcommand)(edit.join)
app.command("edit", cls=Subcommand)(edit_scene.edit)
app.command("view", cls=Subcommand)(view.view)
app.command("publish", cls=Subcommand)(publish.publish)
app.command("render", cls=Subcommand)(render.render)
app.command("bench", cls=Subcommand)(bench.bench)
app.command("eval", cls=Subcommand, epilog=format_explanations(EVAL_COLUMNS))(evaluate.evaluate)
app.command("compare", cls=Subcommand, epilog=format_explanations(COMPARE_COLUMNS))(compare.compare)
app.command("synth", cls=Subcommand)(capture.synth)
app.command("demo", cls=Subcommand)(capture.demo)


def _print_version(is_requested: bool) -> None:
    if is_requested:
        version = f"{VERSION_MAJOR}.{VERSION_MINOR}"
        typer.echo(f"quarc-ref {__version__}, format {version}")
        raise typer.Exit


@app.callback()
def _handle_global_options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the versions.", is_eager=True, callback=_print_version
        ),
    ] = False,
) -> None:
    del version
    logger = logging.getLogger("quarc_ref")
    logger.setLevel(logging.INFO)
    logger.handlers = [MessageHandler()]


def main() -> None:
    """Run the `quarc-ref` command line."""
    ensure_standard_streams()
    with report_failed_output():
        app(prog_name="quarc-ref")
