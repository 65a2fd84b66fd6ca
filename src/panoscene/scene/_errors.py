"""The errors of the file boundary: which file, which field, what was found, what was expected."""

import os
from collections.abc import Sequence, Sized
from dataclasses import dataclass
from typing import cast

MAX_LISTED = 10
"""How many problems an error message lists before it only counts the rest."""


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing that is wrong with a file or a document."""

    field: str
    """Where it is, such as ``$.objects[3].box.size`` or ``line 4, column yaw``."""
    found: str
    """What is there."""
    expected: str
    """What should be there, and where it helps, how to put it right."""

    def __str__(self) -> str:
        """Return the problem as one line."""
        return f"{self.field}: found {self.found}, expected {self.expected}"


class SceneFormatError(ValueError):
    """A scene file, box table or scene document is not what the format says.

    Attributes:
        file: Name of the file, or "scene" for a document that was never in a file.
        problems: Everything that was found wrong, in document order.
    """

    def __init__(self, file: str | os.PathLike[str], problems: Sequence[Problem]) -> None:
        self.file = os.fspath(file)
        self.problems = tuple(problems)
        lines = [str(problem) for problem in self.problems[:MAX_LISTED]]
        if len(self.problems) > MAX_LISTED:
            lines.append(f"... and {len(self.problems) - MAX_LISTED} more problems")
        text = lines[0] if len(lines) == 1 else "".join(f"\n  {line}" for line in lines)
        super().__init__(f"{self.file}: {text}")

    def __reduce__(self) -> tuple[type, tuple[str, tuple[Problem, ...]]]:
        """Let worker processes hand the error on."""
        return type(self), (self.file, self.problems)


def shown(value: object, length: int = 60) -> str:
    """Return a value as it is quoted in an error message: short, on one line."""
    if value is None:
        return "null"
    if isinstance(value, dict | list | tuple):
        kind = "an object" if isinstance(value, dict) else "a list"
        return f"{kind} of {len(cast(Sized, value))}"
    # a very long whole number must not be written out: Python refuses beyond 4300 digits
    if isinstance(value, int) and value.bit_length() > 200:
        return f"a number of about {int(value.bit_length() * 0.30103) + 1} digits"
    text = repr(value)
    return text if len(text) <= length else text[: length - 3] + "..."
