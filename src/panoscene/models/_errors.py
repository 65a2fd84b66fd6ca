"""The error of files with weights."""

import os


class CheckpointError(ValueError):
    """A file with weights is missing, damaged, or made for another network.

    Attributes:
        file: Name of the file.
        found: What is there.
        expected: What should be there, and where it helps, how to put it right.
    """

    def __init__(self, file: str | os.PathLike[str], found: str, expected: str) -> None:
        self.file = os.fspath(file)
        self.found = found
        self.expected = expected
        super().__init__(f"{self.file}: found {found}, expected {expected}")

    def __reduce__(self) -> tuple[type, tuple[str, str, str]]:
        """Let worker processes hand the error on."""
        return type(self), (self.file, self.found, self.expected)
