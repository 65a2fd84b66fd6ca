"""The error of recipes and run folders."""

from panoscene._file_error import FileError


class TrainError(FileError):
    """A recipe, a run folder or a training is not as it should be.

    Attributes:
        file: Name of the file or folder.
        reason: What was found there and what was expected.
    """
