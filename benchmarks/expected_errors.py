"""Reports errors that users can correct, such as a folder that is not a capture."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from quarc_ref.cli.errors import UsageError
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.encoder.settings.presets import SettingError
from quarc_ref.evaluation.same_capture import MismatchError
from quarc_ref.format.errors import QuarcError
from studies import write_status

EXPECTED_ERRORS = (CaptureError, MismatchError, OSError, QuarcError, SettingError, UsageError)


@contextmanager
def report_errors() -> Iterator[None]:
    """Exit with a message if an expected error occurs in a `with` block, or after Ctrl-C.

    The exit code is 2 after an expected error, and 130 after Ctrl-C.
    """
    program = Path(sys.argv[0]).name
    try:
        yield
    except EXPECTED_ERRORS as error:
        write_status(f"{program}: {error}")
        sys.exit(2)
    except KeyboardInterrupt:
        write_status(f"{program}: interrupted")
        sys.exit(130)
