"""What commands say: results on stdout, everything else on stderr."""

import json
import math
import sys
from typing import Any


def say(text: str) -> None:
    """Print a line of the result."""
    sys.stdout.write(_printable(text) + "\n")


def note(text: str) -> None:
    """Print a line that is not part of the result."""
    sys.stderr.write(_printable(text) + "\n")


def complain(message: str) -> None:
    """Print what is wrong."""
    note(f"error: {message}")


def say_json(value: Any) -> None:
    """Print a value as JSON that every reader understands: what is not finite becomes null."""
    say(json_text(value))


def json_text(value: Any) -> str:
    """Return a value as JSON for people and programs, without NaN and Infinity."""
    return json.dumps(_finite(value), indent=2, allow_nan=False)


def _printable(text: str) -> str:
    """Return text whose control characters, from names of files and objects, are only shown."""
    return "".join(
        c if c.isprintable() or c in "\n\t" else c.encode("unicode_escape").decode() for c in text
    )


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
