"""Writing files so that a reader never sees half of one."""

import secrets
from pathlib import Path


def write_atomically(path: Path, text: str) -> None:
    """Write text to a temporary neighbour and move it into place in one step.

    A file that was there stays whole until the new one is complete; if anything fails, it stays.
    """
    path = path.resolve()
    temporary = path.with_name(f".{path.name[:100]}.{secrets.token_hex(4)}.part")
    try:
        with temporary.open("x", encoding="utf-8", newline="\n") as stream:
            stream.write(text)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
