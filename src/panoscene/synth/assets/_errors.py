"""What can go wrong with a file of furniture models."""

from panoscene._file_error import FileError


class AssetError(FileError):
    """A library, model or cache of furniture cannot be used.

    Attributes:
        file: Name of the file, for a member of an archive ``archive!member``.
        reason: What was found and what was expected.
    """
