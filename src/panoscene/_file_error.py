"""The error of a file that cannot be used, for packages to derive theirs from."""

import os


class FileError(ValueError):
    """A file or folder is not what it should be.

    Attributes:
        file: Its name.
        reason: What was found and what was expected.
    """

    def __init__(self, file: str | os.PathLike[str], reason: str) -> None:
        self.file = os.fspath(file)
        self.reason = reason
        super().__init__(f"{self.file}: {reason}")

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        """Let worker processes hand the error on."""
        return type(self), (self.file, self.reason)
