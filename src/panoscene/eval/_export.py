"""Predictions are written once, as scene.json, and scored from disk by anybody."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from pydantic import BaseModel, ValidationError

from panoscene.eval._fov import FOV_DEG
from panoscene.eval._methods import METHODS, Inputs, Method, Simulate
from panoscene.scene import Problem, Scene, SceneFormatError, write_atomically, write_scene
from panoscene.synth import EstimateNoise, estimate_scene, sample_room

TARGETS = "targets"
"""Folder of the true scenes in an export."""
PREDICTIONS = "predictions"
"""Folder in an export with one folder for each method."""
MANIFEST = "export.json"
"""File in an export that says how it was made."""

WEAK_RELATIONS = MappingProxyType({"relation_flip": 0.3, "false_alarm": 0.08})
"""Errors of the relations of ``Inputs.with_weak_relations``: with these the F1 of touching is
about the 0.47 of the paper's network. Source: paper, ablation table."""


@dataclass(frozen=True, slots=True)
class ExportedMethod:
    """What is known of the predictions in one folder."""

    kind: str
    description: str
    fov_deg: int = FOV_DEG[0]
    """Horizontal degrees that the method sees at a time."""
    compared_with: tuple[str, ...] = ()
    """Methods that it should be better than: differences to them are measured scene by scene."""
    shapes: bool = True
    """Whether its meshes, or the boxes that stand in for them, say anything that others do not."""


class Manifest(BaseModel):
    """The part of ``export.json`` that scoring needs."""

    data: str
    """What the targets are."""
    methods: dict[str, ExportedMethod]
    """What is known of each folder of predictions."""
    parts: dict[str, str] = {}
    """Part of the data set that each target is from, by its name; empty if there is one only."""


def sample_targets(count: int, seed: int) -> list[Scene]:
    """Return sampled rooms of 4 to 24 objects, named by their number.

    Room k of a seed is the same whatever the count.

    Raises:
        ValueError: a count or seed below 0.
    """
    if count < 0 or seed < 0:
        raise ValueError(f"count, seed: found {count} and {seed}, expected 0 or more")
    rooms: list[Scene] = []
    for k in range(count):
        rng = np.random.default_rng([seed, k])
        room = sample_room(rng, objects=int(rng.integers(4, 25)))
        rooms.append(replace(room, name=f"room-{k:04d}"))
    return rooms


def export_predictions(
    output: Path,
    targets: Sequence[Scene],
    *,
    seed: int = 0,
    data: str = "",
    methods: Mapping[str, Method] = METHODS,
    noise: EstimateNoise | None = None,
    progress: Callable[[str], None] | None = None,
) -> dict[str, ExportedMethod]:
    """Return the methods whose predictions for the targets now lie in a folder.

    It gets ``targets/NAME.json``, ``predictions/METHOD/NAME.json`` and last ``export.json``,
    which says how they were made; an export without it is not complete.

    Args:
        output: folder; it is made if it does not exist.
        targets: true scenes with different names.
        seed: of the simulated estimates; estimate k depends on seed and k only.
        data: what the targets are, for the reader of the scores.
        methods: what predicts.
        noise: how wrong the simulated estimates are.
        progress: called with a line of text before each method.

    Raises:
        ValueError: names that are missing, double or no file names.
        OSError: something cannot be written.
    """
    tell = progress or (lambda _text: None)
    names = [scene.name for scene in targets]
    check_names(names)
    noise = noise or EstimateNoise()
    inputs = Inputs(targets, _simulation(targets, seed, noise))
    _write_folder(output / TARGETS, names, targets)
    done: dict[str, ExportedMethod] = {}
    for name, method in methods.items():
        tell(name)
        scenes = method.run(inputs)
        _write_folder(output / PREDICTIONS / name, names, scenes)
        done[name] = ExportedMethod(method.kind, method.description, method.fov_deg)
    manifest = {
        "schema": "panoscene/export",
        "version": 1,
        "data": data,
        "scenes": len(targets),
        "seed": seed,
        "noise": asdict(noise),
        "weak_relations": dict(WEAK_RELATIONS),
        "methods": {name: asdict(method) for name, method in done.items()},
    }
    write_atomically(output / MANIFEST, json.dumps(manifest, indent=2) + "\n")
    return done


def read_manifest(path: Path) -> Manifest:
    """Return what the targets of an export are, and what is known of each method.

    Raises:
        SceneFormatError: the file is not the ``export.json`` of an export.
        OSError: it cannot be read.
    """
    try:
        return Manifest.model_validate_json(path.read_bytes())
    except ValidationError as error:
        detail = error.errors(include_url=False)[0]
        where = ".".join(map(str, detail["loc"])) or "$"
        problem = Problem(where, repr(detail["input"])[:60], detail["msg"])
        raise SceneFormatError(path, [problem]) from None


def _simulation(targets: Sequence[Scene], seed: int, noise: EstimateNoise) -> Simulate:
    """Return what makes estimates; the draws for each target are the same at each call."""

    def simulate(*, true_layout: bool = False, weak_relations: bool = False) -> list[Scene]:
        chosen = replace(noise, **WEAK_RELATIONS) if weak_relations else noise
        return [
            estimate_scene(
                scene,
                np.random.default_rng([seed, k, 1]),
                chosen,
                layout=scene.layout if true_layout else None,
            )
            for k, scene in enumerate(targets)
        ]

    return simulate


def check_names(names: Sequence[str]) -> None:
    """Refuse scene names that cannot be names of different files.

    Raises:
        ValueError: names that are missing, double or no file names.
    """
    seen: set[str] = set()
    for name in names:
        if not name or name != Path(name).name or name.startswith("."):
            raise ValueError(f"name: found {name!r}, expected one that can name a file")
        if name in seen:
            raise ValueError(f"name: found {name!r} twice, expected different names")
        seen.add(name)


def _write_folder(folder: Path, names: Sequence[str], scenes: Sequence[Scene]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    expected = {f"{name}.json" for name in names}
    for stale in folder.glob("*.json"):
        # a prediction of an earlier, larger export would be scored with this one
        if stale.name not in expected:
            stale.unlink()
    for name, scene in zip(names, scenes, strict=True):
        write_scene(scene, folder / f"{name}.json")
