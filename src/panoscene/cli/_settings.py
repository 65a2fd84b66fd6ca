"""Settings of the optimiser from a preset, a file and options."""

import difflib
import math
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from panoscene.arrange import ArrangementSettings
from panoscene.cli._errors import InputError
from panoscene.cli._files import read_json_object


def chosen_settings(preset: str, file: Path | None, steps: int | None) -> ArrangementSettings:
    """Return a preset, changed by the settings in a file, changed by options.

    Raises:
        InputError: The file is not what it should be, or a value is out of range.
    """
    document: dict[str, Any] = ArrangementSettings.preset(preset).model_dump()
    if file is not None:
        changes = read_json_object(file, "settings")
        if not _is_finite(changes):
            raise InputError(f"{file}: found NaN or an infinite number, expected finite numbers")
        document = _merged({**document, "name": file.stem}, changes)
    if steps is not None:
        if steps < 0:
            raise InputError(f"--steps: found {steps}, expected 0 or more")
        document["steps"] = steps
    try:
        return ArrangementSettings.model_validate(document)
    except ValidationError as error:
        raise InputError(f"{file}: {_explained(error, document)}") from None


def _merged(base: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    """Return the base with changes, also inside the objects that both have."""
    merged = dict(base)
    for key, value in changes.items():
        inner = base.get(key)
        if isinstance(inner, dict) and isinstance(value, dict):
            value = _merged(inner, value)  # noqa: PLW2901
        merged[key] = value
    return merged


def _explained(error: ValidationError, document: dict[str, Any]) -> str:
    lines = []
    for problem in error.errors(include_url=False, include_context=False):
        *path, name = problem["loc"]
        message = f"found {problem['input']!r}: {problem['msg']}"
        if problem["type"] == "extra_forbidden":
            siblings: Any = document
            for key in path:
                siblings = siblings[key]
            close = difflib.get_close_matches(str(name), [key for key in siblings if key != name])
            message = "there is no such setting" + (
                f"; did you mean {close[0]!r}?" if close else ""
            )
        lines.append(".".join(str(key) for key in problem["loc"]) + f": {message}")
    return lines[0] if len(lines) == 1 else "".join(f"\n  {line}" for line in lines)


def _is_finite(value: Any) -> bool:
    if isinstance(value, dict):
        return all(_is_finite(item) for item in value.values())
    return not isinstance(value, float) or math.isfinite(value)
