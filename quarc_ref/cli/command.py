"""A verb of the command line, whose usage errors are in the tool's own words."""

import typer
from typer.core import TyperCommand

_VALIDATOR_PREFIX = "Value error, "  # of pydantic, with which newer releases of typer check values


class Verb(TyperCommand):
    """A verb that names a wrong value without the prefix of the library that found it."""

    def parse_args(  # type: ignore[override]  # typer does not export the class of its contexts
        self, context: typer.Context, arguments: list[str]
    ) -> list[str]:
        """Read the arguments.

        Raises:
            BadParameter: A value is not one that its option takes.
        """
        try:
            return super().parse_args(context, arguments)
        except typer.BadParameter as error:
            error.message = error.message.removeprefix(_VALIDATOR_PREFIX)
            raise
