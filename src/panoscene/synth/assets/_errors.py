"""What can go wrong with a file of furniture models."""

import os


class AssetError(ValueError):
    """A library, model or cache of furniture cannot be used.

    Attributes:
        file: Name of the file, for a member of an archive ``archive!member``.
        reason: What was found and what was expected.
    """

    def __init__(self, file: str | os.PathLike[str], reason: str) -> None:
        self.file = os.fspath(file)
        self.reason = reason
        super().__init__(f"{self.file}: {reason}")

    def __reduce__(self) -> tuple[type, tuple[str, str]]:
        """Let worker processes hand the error on."""
        return type(self), (self.file, self.reason)
