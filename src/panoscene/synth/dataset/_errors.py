"""The error of data sets on disk."""

import os


class DatasetError(ValueError):
    """A data set, or a file in it, is not what the format says.

    Attributes:
        file: Name of the file or folder.
        reason: What was found there and what was expected.
    """

    def __init__(self, file: str | os.PathLike[str], reason: str) -> None:
        self.file = os.fspath(file)
        self.reason = reason
        super().__init__(f"{self.file}: {reason}")

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        """Let worker processes hand the error on."""
        return type(self), (self.file, self.reason)
