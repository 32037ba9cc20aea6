"""Errors that are raised when files and folders are written."""


class OutputPathError(FileExistsError):
    """An existing file, link or folder must not be replaced, followed or written to.

    Attributes:
        replaceable: Whether quarc-ref created the existing folder, so that `--force` can replace
            it.
    """

    def __init__(self, message: str, *, replaceable: bool = False) -> None:
        super().__init__(message)
        self.replaceable = replaceable
