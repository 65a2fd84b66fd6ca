"""The weights that a command is given: looked at before PyTorch, which takes seconds, is there."""

from pathlib import Path

from panoscene.cli._errors import InputError

STAGES = ("detector", "layout", "pose", "shape", "context")
"""The networks of a pipeline; a folder with weights has STAGE.safetensors for each."""


def check_weights(folder: Path) -> None:
    """Refuse a folder in which a file with weights is missing or cut off.

    What is in the files is checked when they are read.

    Raises:
        InputError: One is.
    """
    from safetensors import SafetensorError, safe_open  # noqa: PLC0415

    for stage in STAGES:
        file = folder / f"{stage}.safetensors"
        expected = "expected a .safetensors file with weights of panoscene"
        try:
            with file.open("rb"):
                pass
            with safe_open(file, framework="numpy"):
                pass
        except OSError as error:
            reason = error.strerror or " ".join(str(error).split())
            raise InputError(f"{file}: found no readable file ({reason}), {expected}") from None
        except SafetensorError as error:
            reason = " ".join(str(error).split())
            raise InputError(f"{file}: found {reason}, {expected}") from None
