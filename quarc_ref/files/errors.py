"""Errors of writing files and folders."""


class OutputPathError(FileExistsError):
    """An existing file or folder must not be replaced, followed or written to.

    Attributes:
        replaceable: Whether quarc-ref created the existing folder, which `--force` can replace.
    """

    def __init__(self, message: str, *, replaceable: bool = False) -> None:
        super().__init__(message)
        self.replaceable = replaceable
