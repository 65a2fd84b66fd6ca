"""The error of data sets on disk."""

from panoscene._file_error import FileError


class DatasetError(FileError):
    """A data set, or a file in it, is not what the format says.

    Attributes:
        file: Name of the file or folder.
        reason: What was found there and what was expected.
    """
