"""The error of recipes and run folders."""

import os


class TrainError(ValueError):
    """A recipe, a run folder or a training is not as it should be.

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
