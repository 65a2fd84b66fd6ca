"""The promise of the ``default`` preset, put to the test on scenes without any sense."""

from collections import Counter
from collections.abc import Callable

import numpy as np
import torch

from panoscene.arrange import PRESETS, arrange_scenes, collate_scenes, energy
from panoscene.geometry import (
    OrientedBoxes,
    box_footprint,
    box_in_room_fraction,
    box_volume,
    penetration_depth,
    signed_distance_to_polygon,
)
from panoscene.scene import Scene
from panoscene.synth import sample_nonsense

_CHUNK = 250
_LARGEST = 64
_SLACK = 1e-4
"""Relative and absolute rounding of single precision that does not count as worse."""
_TOLERANCE = 0.1
"""Metres of overlap that the paper's count of pairs forgives."""


def violations(scene: Scene, observed: Scene) -> dict[str, float]:
    """Return what ``default`` promises not to make larger, measured on the boxes of a scene.

    Independent of the certificate: in double precision, pair by pair on the finished boxes, with
    the energy of ``default`` judged by what was ``observed``.
    """
    boxes, layout = scene.objects.boxes, scene.layout
    boxes = OrientedBoxes(boxes.centre.double(), boxes.size.double(), boxes.yaw.double())
    if len(boxes) == 0:
        return dict.fromkeys(("energy", "pairs", "deepest", "depth", "outside", "volume"), 0.0)
    polygon = layout.floor_polygon.double()
    depth = penetration_depth(boxes[:, None], boxes[None]).triu(diagonal=1)
    aside = signed_distance_to_polygon(box_footprint(boxes).flatten(0, 1), polygon)
    bottom, top = (boxes.centre[:, 2] + sign * boxes.size[:, 2] / 2 for sign in (-1, 1))
    outside = torch.stack(
        [
            aside.unflatten(0, (-1, 4)).amax(-1),
            layout.floor_height - bottom,
            top - layout.ceiling_height,
        ]
    ).amax(0)
    batch = collate_scenes([observed])
    inside = batch.inside_room[0].double() >= 0.5
    fraction = box_in_room_fraction(boxes, polygon, layout.floor_height, layout.ceiling_height)
    judged = energy(batch, PRESETS["default"], boxes=scene.objects.boxes[None])
    return {
        "energy": float(judged.sum()),
        "pairs": float((depth > _TOLERANCE).sum()),
        "deepest": float(depth.max()),
        "depth": float(depth.sum()),
        "outside": float((torch.relu(outside) * inside).max()),
        "volume": float((box_volume(boxes) * (1 - fraction)).sum()),
    }


def broken_promises(before: Scene, after: Scene) -> list[str]:
    """Return what is worse than before or not finite; empty for every result of ``default``."""
    boxes = after.objects.boxes
    if not all(bool(torch.isfinite(v).all()) for v in (boxes.centre, boxes.size, boxes.yaw)):
        return ["not finite"]
    if not bool((boxes.size > 0).all()):
        return ["size not positive"]
    old, new = violations(before, before), violations(after, before)
    return [name for name in old if not new[name] <= old[name] + _SLACK * (1 + abs(old[name]))]


def run_arrange_safety(
    *, scenes: int = 10_000, seed: int = 0, progress: Callable[[str], None] | None = None
) -> dict[str, object]:
    """Return how many nonsense scenes ``default`` made worse (``worse``: none, it promises).

    Objects per scene: 0 to 64, geometric with mean 4.6. ``outcomes`` counts what became of the
    scenes, ``broken`` the promises that were not kept, by name.
    """
    rng = np.random.default_rng(seed)
    counts = np.minimum(rng.geometric(0.18, size=scenes) - 1, _LARGEST)
    counts[: min(scenes, 3)] = (0, 1, _LARGEST)[: min(scenes, 3)]
    counts = np.sort(counts)
    outcomes: Counter[str] = Counter()
    broken: Counter[str] = Counter()
    worse = 0
    for first in range(0, scenes, _CHUNK):
        chunk = [sample_nonsense(rng, int(n)) for n in counts[first : first + _CHUNK]]
        for scene, result in zip(chunk, arrange_scenes(chunk, "default"), strict=True):
            outcomes[result.certificate.outcome] += 1
            faults = broken_promises(scene, result.scene)
            broken.update(faults)
            worse += bool(faults)
        if progress:
            progress(f"{min(first + _CHUNK, scenes)} of {scenes} scenes, {worse} worse")
    return {
        "scenes": scenes,
        "seed": seed,
        "worse": worse,
        "broken": dict(broken),
        "outcomes": dict(outcomes),
    }


def safety_table(result: dict[str, object]) -> str:
    """Return in one paragraph what ``run_arrange_safety`` found."""
    outcomes = result["outcomes"]
    if not isinstance(outcomes, dict):
        raise TypeError(f"result: found outcomes {outcomes!r}, expected counts by name")
    often = sorted(outcomes.items(), key=lambda item: (-item[1], item[0]))
    listed = "; ".join(f"{name}: {count}" for name, count in often)
    return (
        f"Of {result['scenes']} scenes without any sense, {result['worse']} came out worse or not "
        f"finite. Outcomes: {listed}."
    )
