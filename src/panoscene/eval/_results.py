"""The file of scores: what was measured on one folder of predictions, with intervals."""

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from panoscene.scene import Problem, SceneFormatError, write_atomically

SCORE_SCHEMA, SCORE_VERSION = "panoscene/score", 1


class _Model(BaseModel):
    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, populate_by_name=True
    )


class Measured(_Model):
    """One number with its 95 % interval over scenes; None where it is not defined."""

    value: float | None
    low: float | None = None
    high: float | None = None


class ScoreFile(_Model):
    """All scores of one method on one set of targets."""

    schema_name: Literal["panoscene/score"] = Field(default=SCORE_SCHEMA, alias="schema")
    version: Literal[1] = SCORE_VERSION
    panoscene: str
    """Version of the package that scored."""
    method: str
    kind: str
    """ours, released, input, baseline, oracle, or prediction for anybody's folder."""
    description: str
    fov_deg: Annotated[int, Field(ge=1, le=360)] = 360
    """Horizontal degrees that the method saw at a time; 360 is the whole room."""
    data: str
    """What the targets are."""
    scenes: Annotated[int, Field(ge=0)]
    objects: Annotated[int, Field(ge=0)]
    """Target objects."""
    missing: Annotated[int, Field(ge=0)]
    """Scenes without a prediction that can be read; they count as empty, never as absent."""
    invalid: Annotated[int, Field(ge=0)] = 0
    """Predictions in which something is not valid, and so counts as not predicted."""
    targets_hash: str
    """First 16 hexadecimal digits of the SHA-256 of all target files."""
    predictions_hash: str
    replicates: Annotated[int, Field(ge=0)]
    """Bootstrap resamples behind the intervals."""
    seed: int
    metrics: dict[str, Measured]
    """By dotted names, such as ``detection.ap_15_mean_57``."""
    categories: dict[str, dict[str, Measured]]
    """Per category; categories without targets and predictions are left out."""
    parts: dict[str, dict[str, Measured]] = {}
    """The metrics of single parts of the data set; empty if there is one part only."""
    differences: dict[str, dict[str, Measured]] = {}
    """By how much the metrics are above those of other methods, scene by scene; by their names."""


def write_scores(scores: ScoreFile, path: str | os.PathLike[str]) -> None:
    """Write a file of scores; it appears complete or not at all."""
    write_atomically(Path(path), _one_metric_a_line(scores.model_dump(by_alias=True)) + "\n")


def read_scores(path: str | os.PathLike[str]) -> ScoreFile:
    """Return the scores in a file.

    Raises:
        SceneFormatError: the file is not a file of scores of this version.
        OSError: it cannot be read.
    """
    try:
        return ScoreFile.model_validate_json(Path(path).read_bytes())
    except ValidationError as error:
        problems = [
            Problem(
                ".".join(map(str, detail["loc"])) or "$", repr(detail["input"])[:60], detail["msg"]
            )
            for detail in error.errors(include_url=False)[:5]
        ]
        raise SceneFormatError(os.fspath(path), problems) from None


def _one_metric_a_line(document: Mapping[str, object]) -> str:
    """Return JSON with a line for each fact, metric and category."""
    lines: list[str] = []
    for key, value in document.items():
        if isinstance(value, Mapping):
            rows = ",\n".join(f"  {_line(name)}: {_line(row)}" for name, row in value.items())
            lines.append(f" {_line(key)}: {{\n{rows}\n }}" if rows else f" {_line(key)}: {{}}")
        else:
            lines.append(f" {_line(key)}: {_line(value)}")
    return "{\n" + ",\n".join(lines) + "\n}"


def _line(value: object) -> str:
    return json.dumps(value, allow_nan=False)
