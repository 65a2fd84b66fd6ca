"""What the report's page is made of, as plain values for JSON."""

import base64
import math
from collections.abc import Mapping

import torch
from torch import Tensor

from panoscene.arrange import COLLISION_TERMS, OBSERVATION_TERMS, Certificate, Violations
from panoscene.geometry import (
    OrientedBoxes,
    box_footprint,
    polygon_turn,
    signed_distance_to_polygon,
)
from panoscene.scene import (
    BUILT_IN,
    CATEGORIES,
    Layout,
    Mesh,
    Relations,
    Scene,
    object_names,
    relation_triples,
    room_surfaces,
)
from panoscene.style import GROUP_COLOURS, NO_FRONT, WALL_THICKNESS, group_of, words
from panoscene.views._pieces import IN_WALL, TOLERANCE, overlaps
from panoscene.views._report_colours import PALETTES, category_colour

Values = dict[str, object]

PREDICATE_WORDS = {
    "touching": "touches",
    "on_floor": "stands on",
    "under_ceiling": "hangs from",
    "inside_room": "is (partly) inside",
    "farther_than": "is farther than",
    "relative_yaw": "turn to",
}
"""Relations as the tables say them."""


def report_data(
    scene: Scene,
    relations: Relations,
    before: Scene | None,
    certificate: Certificate | None,
    timings: Mapping[str, float],
    *,
    tolerance: float = TOLERANCE,
) -> Values:
    """Return everything that the page's scripts show, as plain values."""
    related = Scene(scene.panorama, scene.layout, scene.objects, relations, scene.name)
    categories = [CATEGORIES[k] for k in scene.objects.category.tolist()]
    worn = {group_of(category) for category in categories}
    faults = {"after": box_faults(scene, tolerance)}
    if before is not None:
        faults["before"] = box_faults(before, tolerance)
    return {
        "camera_height": scene.panorama.camera_height,
        "layout": _layout(scene),
        "objects": _objects(scene, categories),
        "before": None if before is None else [{"box": box} for box in _boxes(before)],
        "faults": faults,
        "relations": _relations(related),
        "predicates": PREDICATE_WORDS,
        "groups": [pair for pair in GROUP_COLOURS.items() if pair[0] in worn],
        "palettes": PALETTES,
        "certificate": None if certificate is None else _certificate(certificate),
        "timings": [[label, float(seconds)] for label, seconds in timings.items()],
    }


def box_faults(scene: Scene, tolerance: float = TOLERANCE) -> list[str | None]:
    """Return what is physically wrong with each object, from some metres on, or None.

    Doors and windows may be in the walls, cushions in sofas (``nested``). What is outside the room
    is told even where inside_room says that it belongs there, as the pictures from above hatch it.
    """
    boxes, names = scene.objects.boxes, object_names(scene.objects)
    if len(boxes) == 0:
        return []
    deepest, partner = overlaps(scene.objects).max(dim=1)
    outside = _distance_outside(boxes, scene.layout)
    allowed = [
        max(tolerance, IN_WALL) if CATEGORIES[k] in BUILT_IN else tolerance
        for k in scene.objects.category.tolist()
    ]
    faults: list[str | None] = []
    columns = zip(deepest.tolist(), partner.tolist(), outside.tolist(), allowed, strict=True)
    for overlap, other, beyond, most in columns:
        parts = [f"overlaps {names[other]} by {100 * overlap:.0f} cm"] * (overlap > tolerance)
        parts += [f"{100 * beyond:.0f} cm outside the room"] * (beyond > most)
        faults.append(", ".join(parts) or None)
    return faults


def _distance_outside(boxes: OrientedBoxes, layout: Layout) -> Tensor:
    """Return how far each box reaches beyond walls, floor or ceiling, in metres."""
    corner = box_footprint(boxes)
    polygon = layout.floor_polygon.to(corner)
    aside = signed_distance_to_polygon(corner.flatten(0, 1), polygon).unflatten(0, (-1, 4))
    half = boxes.size[:, 2] / 2
    below = layout.floor_height - boxes.centre[:, 2] + half
    above = boxes.centre[:, 2] + half - layout.ceiling_height
    return torch.relu(torch.stack([aside.amax(dim=1), below, above]).amax(dim=0))


def _rounded(values: Tensor) -> list[float]:
    return [round(value, 4) for value in values.tolist()]


def _boxes(scene: Scene) -> list[Values]:
    boxes = scene.objects.boxes
    columns = zip(boxes.centre, boxes.size, boxes.yaw.tolist(), strict=True)
    return [
        {"centre": _rounded(centre), "size": _rounded(size), "yaw": round(yaw, 5)}
        for centre, size, yaw in columns
    ]


def _layout(scene: Scene) -> Values:
    layout = scene.layout
    floor, *_ = room_surfaces(layout)
    return {
        "polygon": [_rounded(corner) for corner in layout.floor_polygon],
        "floor": layout.floor_height,
        "ceiling": layout.ceiling_height,
        "triangles": floor.faces.tolist(),
        "turn": polygon_turn(scene.layout.floor_polygon),
        "wall_thickness": WALL_THICKNESS,
    }


def _objects(scene: Scene, categories: list[str]) -> list[Values]:
    objects = scene.objects
    scores = torch.stack([objects.score, objects.distance_score, objects.yaw_score], dim=1)
    meshes = objects.shapes.mesh or (None,) * len(categories)
    columns = zip(
        object_names(objects), categories, _boxes(scene), scores.tolist(), meshes, strict=True
    )
    return [
        {
            "name": name,
            "category": words(category),
            "colour": category_colour(category),
            "has_front": category not in NO_FRONT,
            "on_wall": group_of(category) == "doors and windows",
            "box": box,
            "scores": [round(score, 3) for score in three],
            "shape": None if mesh is None or len(mesh.faces) == 0 else _shape(mesh),
        }
        for name, category, box, three, mesh in columns
    ]


def _shape(mesh: Mesh) -> Values:
    """Return a canonical mesh as little-endian float32 and uint32 in base64."""
    vertices = mesh.vertices.detach().cpu().numpy().astype("<f4").tobytes()
    faces = mesh.faces.detach().cpu().numpy().astype("<u4").tobytes()
    return {
        "vertices": base64.b64encode(vertices).decode(),
        "faces": base64.b64encode(faces).decode(),
    }


def _relations(scene: Scene) -> list[Values]:
    return [
        {
            "subject": triple.subject,
            "predicate": triple.predicate,
            "object": triple.object,
            "score": round(triple.score, 3),
            "angle_deg": None if triple.angle is None else round(math.degrees(triple.angle), 1),
        }
        for triple in relation_triples(scene)
    ]


def _certificate(certificate: Certificate) -> Values:
    before, after = certificate.before, certificate.after
    facts = {
        "Preset": certificate.preset,
        "Steps": str(certificate.steps),
        "Changed": "yes" if certificate.changed else "no",
        "Converged": "yes" if certificate.converged else "no",
        "Largest change of size": f"{100 * (certificate.largest_size_change - 1):.1f} %",
        "Not meant to be inside, left there": str(certificate.left_outside),
    }
    return {
        "outcome": certificate.outcome,
        "facts": list(facts.items()),
        "measures": _measures(before, after),
        "terms": [
            {"label": _term_words(name), "before": before.terms[name], "after": after.terms[name]}
            for name in sorted(before.terms, key=lambda name: -before.terms[name])
        ],
    }


def _term_words(name: str) -> str:
    text = name.replace("_", " ")
    if name in COLLISION_TERMS:
        return text
    return f"{text} (seen)" if name in OBSERVATION_TERMS else text


def _measures(before: Violations, after: Violations) -> list[Values]:
    metres = "{:.1f} cm"
    kinds: list[tuple[str, str, str, float]] = [
        ("Energy", "energy", "{:.3f}", 1.0),
        ("Pairs that collide by over 10 cm", "colliding_pairs", "{:.0f}", 1.0),
        ("Worst overlap of two objects", "worst_penetration", metres, 100.0),
        ("Sum of all overlaps", "total_penetration", metres, 100.0),
        ("Farthest outside, of what belongs inside", "worst_out_of_room", metres, 100.0),
        ("Volume outside the room", "out_of_room_volume", "{:.3f} m³", 1.0),
    ]
    rows: list[Values] = []
    for label, name, text, unit in kinds:
        first, second = (text.format(unit * getattr(state, name)) for state in (before, after))
        lower = getattr(after, name) < getattr(before, name)
        change = "" if first == second else "better" if lower else "worse"
        rows.append({"label": label, "before": first, "after": second, "change": change})
    return rows
