"""Folders that commands write into."""

from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryFile

from panoscene.cli._errors import InputError


def check_folder(output: Path) -> None:
    """Refuse an output that is not a folder and cannot become one, before the work and not after.

    Raises:
        InputError: There is a file of that name, or nothing can be written there.
    """
    if output.exists() and not output.is_dir():
        raise InputError(f"--output {output}: found a file, expected a folder")
    missing = [folder for folder in (output, *output.parents) if not folder.exists()]
    try:
        # whoever fails later leaves no empty folder
        output.mkdir(parents=True, exist_ok=True)
        TemporaryFile(dir=output).close()
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        expected = "expected a folder to write into"
        raise InputError(f"--output {output}: cannot be written: {reason}; {expected}") from None
    finally:
        for folder in missing:
            with suppress(OSError):
                folder.rmdir()
