"""Entry point of the command `quarc-ref`, and of `python -m quarc_ref`."""

from quarc_ref.cli.signals import exit_on_signals


def main() -> None:
    """Run the `quarc-ref` command line."""
    exit_on_signals()
    from quarc_ref.cli import app  # takes long enough for a signal to arrive

    app.main()


if __name__ == "__main__":
    main()
