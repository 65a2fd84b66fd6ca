"""The experiment of the paper's Sec. 4 on relation optimisation, on sampled rooms.

Ground-truth rooms are perturbed (``PerturbNoise`` documents the noise) and repaired, once with the
true relations and once with corrupted ones, by every preset, and by ``default`` without each third
of the energy.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, replace

import numpy as np
import torch

from panoscene.arrange import (
    COLLISION_TERMS,
    OBSERVATION_TERMS,
    PRESETS,
    RELATION_TERMS,
    Arrangement,
    ArrangementSettings,
    TermWeights,
    arrange_scenes,
)
from panoscene.eval._machine import machine_facts
from panoscene.geometry import (
    box_in_room_fraction,
    box_volume,
    paired_box_iou,
    separation_margins,
    wrap_angle,
)
from panoscene.scene import Scene
from panoscene.synth import PerturbNoise, corrupt_relations, perturb_scene, sample_room

_FLIP = 0.1
_FALSE_ALARM = 0.01
_BROKEN_METRES = 1.0
_CHUNK = 64
_ABLATIONS = {
    "default without E^c": COLLISION_TERMS,
    "default without E^r": RELATION_TERMS,
    "default without E^o": OBSERVATION_TERMS,
}

Progress = Callable[[str], None] | None


def run_arrange_experiment(
    *,
    scenes: int = 100,
    seed: int = 0,
    presets: Sequence[str] = ("paper", "released", "default"),
    progress: Progress = None,
) -> dict[str, object]:
    """Return a table of errors and violations before and after optimisation.

    Each row: the method, the relations it was given, and means over all objects (``iou``: 3D IoU
    with the truth, ``centre_error_m``, ``yaw_error_deg``) or over scenes (``colliding_pairs``:
    pairs that overlap by more than 0.1 m, ``penetration_m``: sum over pairs,
    ``out_of_room_m3``, ``broken``: share of scenes with a box that moved away from the truth by
    over 1 m more than before, or that is not finite, ``unchanged``: share returned as they came).

    Args:
        scenes: number of rooms, of 4 to 24 objects.
        seed: of everything random.
        presets: which presets to run; ``default`` brings its ablation along.
        progress: called with a line of text before each method.
    """
    tell = progress or (lambda _text: None)
    rng = np.random.default_rng(seed)
    truth = [sample_room(rng, objects=int(rng.integers(4, 25))) for _ in range(scenes)]
    noise = PerturbNoise()
    noisy = [perturb_scene(room, rng, noise) for room in truth]
    corrupted = [
        replace(
            scene,
            relations=corrupt_relations(room.relations, rng, flip=_FLIP, false_alarm=_FALSE_ALARM),
        )
        for scene, room in zip(noisy, truth, strict=True)
        if room.relations is not None
    ]
    rows = [_row("before", "-", noisy, truth, noisy, None)]
    methods: dict[str, ArrangementSettings] = {name: PRESETS[name] for name in presets}
    if "default" in presets:
        methods |= {label: _without(terms) for label, terms in _ABLATIONS.items()}
    for label, settings in methods.items():
        for relations, inputs in (("true", noisy), ("corrupted", corrupted)):
            tell(f"{label}, {relations} relations")
            results = [
                result
                for first in range(0, len(inputs), _CHUNK)
                for result in arrange_scenes(inputs[first : first + _CHUNK], settings)
            ]
            repaired = [result.scene for result in results]
            rows.append(_row(label, relations, repaired, truth, noisy, results))
    return {
        "rows": rows,
        "scenes": scenes,
        "objects": sum(len(room.objects.boxes) for room in truth),
        "seed": seed,
        "noise": asdict(noise),
        "relation_flip": _FLIP,
        "relation_false_alarm": _FALSE_ALARM,
        "machine": machine_facts(),
    }


def experiment_table(result: dict[str, object]) -> str:
    """Return the rows as a Markdown table."""
    rows = result["rows"]
    if not isinstance(rows, list) or not rows:
        raise ValueError("result: found no rows, expected what run_arrange_experiment returns")
    names = list(rows[0])
    lines = ["| " + " | ".join(names) + " |"]
    lines.append("| " + " | ".join("---" if n in names[:2] else "---:" for n in names) + " |")
    for row in rows:
        cells = [f"{v:.3f}" if isinstance(v, float) else str(v) for v in row.values()]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _without(terms: tuple[str, ...]) -> ArrangementSettings:
    """Return the default without some terms; ``safe`` would hide what they are for."""
    weights = TermWeights(**{**PRESETS["default"].weights.model_dump(), **dict.fromkeys(terms, 0)})
    return PRESETS["default"].model_copy(update={"weights": weights, "safe": False})


def _row(  # noqa: PLR0917 - one row has six sources
    method: str,
    relations: str,
    scenes: Sequence[Scene],
    truth: Sequence[Scene],
    start: Sequence[Scene],
    results: Sequence[Arrangement] | None,
) -> dict[str, object]:
    ious, centres, yaws, broken = [], [], [], []
    pairs, depth, outside = [], [], []
    for scene, room, before in zip(scenes, truth, start, strict=True):
        found, wanted = scene.objects.boxes, room.objects.boxes
        error = (found.centre - wanted.centre).norm(dim=-1)
        first = (before.objects.boxes.centre - wanted.centre).norm(dim=-1)
        finite = bool(torch.isfinite(error).all())
        broken.append(not finite or bool((error - first > _BROKEN_METRES).any()))
        ious.append(paired_box_iou(found, wanted))
        centres.append(error)
        yaws.append(torch.rad2deg(wrap_angle(found.yaw - wanted.yaw).abs()))
        margin = separation_margins(found[:, None], found[None]).amin(-1)
        overlap = torch.relu(margin).triu(diagonal=1)
        pairs.append(int((overlap > 0.1).sum()))
        depth.append(float(overlap.sum()))
        layout = room.layout
        inside = box_in_room_fraction(
            found, layout.floor_polygon, layout.floor_height, layout.ceiling_height
        )
        outside.append(float((box_volume(found) * (1 - inside)).sum()))
    unchanged = 0.0
    if results is not None:
        unchanged = float(np.mean([not result.certificate.changed for result in results]))
    return {
        "method": method,
        "relations": relations,
        "iou": float(torch.cat(ious).mean()),
        "centre_error_m": float(torch.cat(centres).mean()),
        "yaw_error_deg": float(torch.cat(yaws).mean()),
        "colliding_pairs": float(np.mean(pairs)),
        "penetration_m": float(np.mean(depth)),
        "out_of_room_m3": float(np.mean(outside)),
        "broken": float(np.mean(broken)),
        "unchanged": unchanged,
    }
