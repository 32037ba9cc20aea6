"""Loads the LPIPS metric for `eval` and `compare`, with the weights given by `--lpips`."""

from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.errors import UsageError

if TYPE_CHECKING:
    from quarc_ref.evaluation.lpips import Lpips


def load_lpips(path: Path | None) -> "Lpips | None":
    """Return the LPIPS metric with weights from a file; None if `path` is None.

    Raises:
        UsageError: The file does not contain LPIPS weights.
        ImportError: torch is not installed.
    """
    if path is None:
        return None
    from quarc_ref.evaluation.lpips import Lpips, WeightsError

    try:
        return Lpips(path)
    except WeightsError as error:
        message = f"--lpips: {error}"
        raise UsageError(message) from error
