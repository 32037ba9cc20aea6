"""The class of all subcommands, which tells users the new names of renamed options."""

import typer
from typer.core import TyperCommand

RENAMED_OPTIONS = {
    "--canonical-every": "--keyframe-interval",
    "--seek-every": "--snapshot-interval",
    "--play": "--autoplay",
    "--no-play": "--no-autoplay",
}
# Newer releases of typer check values with pydantic, whose messages have this prefix.
_VALIDATOR_PREFIX = "Value error, "


class Subcommand(TyperCommand):
    """A subcommand that rejects old names of options and reports the new names."""

    def parse_args(  # type: ignore[override]  # typer does not export the class of its contexts
        self, context: typer.Context, arguments: list[str]
    ) -> list[str]:
        """Parse the arguments; reject old names of renamed options.

        Raises:
            BadParameter: An option has an old name or an invalid value.
        """
        for argument in arguments:
            name = argument.partition("=")[0]
            if name in RENAMED_OPTIONS:
                message = f"{name} is now {RENAMED_OPTIONS[name]}"
                raise typer.BadParameter(message, context)
        try:
            return super().parse_args(context, arguments)
        except typer.BadParameter as error:
            error.message = error.message.removeprefix(_VALIDATOR_PREFIX)
            raise
