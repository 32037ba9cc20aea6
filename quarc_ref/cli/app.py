"""The `quarc-ref` application: registers all commands, and handles `--version`.

Commands import heavy modules inside their functions, so that `--help` is fast and `info`, `verify`
and `decode` need neither torch nor OpenCV.
"""

import logging
from typing import Annotated

import typer

from quarc_ref import __version__
from quarc_ref.cli.columns import COMPARE_COLUMNS, EVAL_COLUMNS, INFO_ROWS, format_explanations
from quarc_ref.cli.command import Verb
from quarc_ref.cli.errors import ensure_standard_streams, install_sigterm_handler
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
app.command("calibrate", cls=Verb)(calibrate.calibrate)
app.command("doctor", cls=Verb)(doctor.doctor)
app.command("encode", cls=Verb)(encode.encode)
app.command("import", cls=Verb)(scenes.import_frames)
app.command("decode", cls=Verb)(decode.decode_frames)
app.command("verify", cls=Verb)(stream.verify)
app.command("info", cls=Verb, epilog=format_explanations(INFO_ROWS))(stream.info)
app.command("inspect", cls=Verb)(inspect.inspect)
app.command("cut", cls=Verb)(edit.cut)
app.command("join", cls=Verb)(edit.join)
app.command("edit", cls=Verb)(edit_scene.edit)
app.command("view", cls=Verb)(view.view)
app.command("publish", cls=Verb)(publish.publish)
app.command("render", cls=Verb)(render.render)
app.command("bench", cls=Verb)(bench.bench)
app.command("eval", cls=Verb, epilog=format_explanations(EVAL_COLUMNS))(evaluate.evaluate)
app.command("compare", cls=Verb, epilog=format_explanations(COMPARE_COLUMNS))(compare.compare)
app.command("synth", cls=Verb)(capture.synth)
app.command("demo", cls=Verb)(capture.demo)


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
    install_sigterm_handler()
    app(prog_name="quarc-ref")
