"""The panorama with layout, boxes, fronts and names drawn on it."""

import os
from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.scene import CATEGORIES, Scene
from panoscene.style import ALARM, GROUP_COLOURS, INK, PAPER, group_of, label_fill, words
from panoscene.views._curves import Curve, overlay_curves
from panoscene.views._overlay_labels import Placed, Target, place_labels
from panoscene.views._page import Page
from panoscene.views._pictures import fitted_pixels, plain_room
from panoscene.views._pieces import TOLERANCE, colliding_pairs

USUAL_WIDTH, LEAST_WIDTH, MOST_WIDTH = 2048, 64, 16384
"""Pixels."""
_LAYOUT_WIDTH, _EDGE_WIDTH, _HIDDEN_WIDTH, _FRONT_WIDTH = 1.9, 1.9, 1.0, 2.6
"""Of lines, for a picture that is 1024 pixels wide."""
_RIM = 1.5
"""Of dark ink on both sides of a line that is seen, likewise."""


def draw_overlay(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    image: Float[Tensor, "3 height width"] | None = None,
    reference: Scene | None = None,
    labels: bool = True,
    width_px: int | None = None,
    tolerance: float = TOLERANCE,
) -> None:
    """Write a PNG of the panorama with the scene drawn on it.

    It shows where walls meet floor, ceiling and each other, in white; the edges of the objects'
    boxes in the colour of their group, with the front's lower edge drawn heavier and an arrow
    before it; and names, with the score below 1. Edges at the back, and what is behind other
    boxes, are thin; so is the layout behind walls and boxes. Names and edges of colliding boxes
    are rimmed in red.

    Args:
        scene: what to draw.
        path: file to write; it appears complete or not at all.
        image: the photo as colours in [0, 1]; without it, a plain drawing of the empty room.
        reference: a scene whose boxes and layout are drawn as dashed white lines, such as the
            truth.
        labels: whether to write names.
        width_px: width of the picture, twice its height; by default that of the photo, at most
            2048, and 2048 without a photo.
        tolerance: metres of overlap from which boxes collide.

    Raises:
        ValueError: boxes or corners that are not finite, or a width that is odd or not between
            64 and 16384.
    """
    if width_px is None:
        width_px = USUAL_WIDTH if image is None else min(image.shape[2] // 2 * 2, USUAL_WIDTH)
    page = overlay_page(
        scene, width_px, image=image, reference=reference, labels=labels, tolerance=tolerance
    )
    page.save(path)


def overlay_page(
    scene: Scene,
    width: int,
    *,
    image: Float[Tensor, "3 height width"] | None = None,
    reference: Scene | None = None,
    labels: bool = True,
    tolerance: float = TOLERANCE,
) -> Page:
    """Return the overlay as a page, for ``draw_overlay`` and for sheets."""
    if width % 2 or not LEAST_WIDTH <= width <= MOST_WIDTH:
        expected = f"an even number from {LEAST_WIDTH} to {MOST_WIDTH}"
        raise ValueError(f"width_px: found {width}, expected {expected}")
    height = width // 2
    curves = overlay_curves(scene)
    page = Page(width, height)
    if image is None:
        ground = plain_room(scene.layout, scene.panorama.camera_height, width, height)
    else:
        ground = fitted_pixels(image, width, height)
    page.image(ground, 0, 0)
    unit = (width / 1024) ** 0.8
    _draw_layout(page, curves, unit)
    if reference is not None:
        _draw_reference(page, scene, reference, unit)
    pairs = colliding_pairs(scene.objects, tolerance)
    colliding = set(pairs.flatten().tolist())
    _draw_objects(page, scene, curves, colliding, unit)
    if labels:
        _draw_labels(page, scene, curves, colliding)
    return page


def _on_page(page: Page, curves: Iterable[Curve]) -> list[np.ndarray]:
    """Return curves in pixels of a page, whose y runs up."""
    scale = np.array([page.width / (2 * np.pi), page.height / np.pi])
    middle = np.array([page.width / 2, page.height / 2])
    return [curve.lonlat * scale + middle for curve in curves]


def _draw_layout(page: Page, curves: Sequence[Curve], unit: float) -> None:
    room = [curve for curve in curves if curve.kind in ("floor", "ceiling", "corner")]
    hidden = _on_page(page, [curve for curve in room if not curve.visible])
    seen = _on_page(page, [curve for curve in room if curve.visible])
    thin = _HIDDEN_WIDTH * unit
    page.lines(hidden, colour=INK, width=thin + unit, alpha=0.25)
    page.lines(hidden, colour=PAPER, width=thin, dashes=(4 * unit, 4 * unit), alpha=0.7)
    width = _LAYOUT_WIDTH * unit
    page.lines(seen, colour=INK, width=width + 2 * _RIM * unit, alpha=0.75)
    page.lines(seen, colour=PAPER, width=width)


def _draw_reference(page: Page, scene: Scene, reference: Scene, unit: float) -> None:
    """Draw boxes, and the layout where it is another one."""
    kinds = ["edge"] if _same_room(scene, reference) else ["edge", "floor", "ceiling", "corner"]
    curves = overlay_curves(reference)
    seen = _on_page(page, [curve for curve in curves if curve.visible and curve.kind in kinds])
    page.lines(seen, colour=INK, width=2.6 * unit, alpha=0.45)
    page.lines(seen, colour=PAPER, width=1.2 * unit, dashes=(5 * unit, 3 * unit))


def _same_room(scene: Scene, other: Scene) -> bool:
    a, b = scene.layout, other.layout
    heights = a.floor_height == b.floor_height and a.ceiling_height == b.ceiling_height
    return heights and torch.equal(a.floor_polygon, b.floor_polygon)


def _draw_objects(
    page: Page, scene: Scene, curves: Sequence[Curve], colliding: set[int], unit: float
) -> None:
    """Draw the boxes, the farthest first."""
    own: dict[int, list[Curve]] = defaultdict(list)
    for curve in curves:
        if curve.kind in ("edge", "front"):
            own[curve.index].append(curve)
    distance = scene.objects.boxes.centre.norm(dim=-1).tolist()
    for index in sorted(own, key=lambda k: -distance[k]):
        colour = GROUP_COLOURS[group_of(CATEGORIES[int(scene.objects.category[index])])]
        rim = ALARM if index in colliding else INK
        _draw_box(page, own[index], colour, rim, unit)


def _draw_box(page: Page, curves: Sequence[Curve], colour: str, rim: str, unit: float) -> None:
    edges = [curve for curve in curves if curve.kind == "edge"]
    arrow = [curve for curve in curves if curve.kind == "front"]
    # without arrow, the front says nothing either
    bar = [curve for curve in edges if curve.part == 1 and curve.visible and arrow]
    hidden = _on_page(page, [curve for curve in curves if not curve.visible])
    page.lines(hidden, colour=INK, width=(_HIDDEN_WIDTH + 0.8) * unit, alpha=0.35)
    page.lines(hidden, colour=colour, width=_HIDDEN_WIDTH * unit, alpha=0.8)
    seen = _on_page(page, [edge for edge in edges if edge.visible])
    front = _on_page(page, [*bar, *(curve for curve in arrow if curve.visible)])
    strokes = [(seen, _EDGE_WIDTH), (front, _FRONT_WIDTH)]
    for lines, width in strokes:
        page.lines(lines, colour=rim, width=(width + 2 * _RIM) * unit, alpha=0.85)
    for lines, width in strokes:
        page.lines(lines, colour=colour, width=width * unit)


def _draw_labels(page: Page, scene: Scene, curves: Sequence[Curve], colliding: set[int]) -> None:
    """Write the names on plates in the colour of the group."""
    size = 7.0 + page.width / 205
    texts = [label_text(scene, k, k in colliding) for k in range(len(scene.objects.boxes))]
    targets = _targets(page, curves, texts, size)
    placed = place_labels(targets, page.width, page.height)
    plates = {target.index: target.size for target in targets}
    for label in placed:
        if label.leader is not None:
            ends = [(u, page.height - v) for u, v in ((label.u, label.v), label.leader)]
            page.line(ends, colour=INK, width=0.26 * size)
            page.line(ends, colour=PAPER, width=0.1 * size)
    for label in placed:
        category = CATEGORIES[int(scene.objects.category[label.index])]
        red = label.index in colliding
        _draw_plate(page, label, plates[label.index], group_of(category), red=red)
        page.text(
            label.u,
            page.height - label.v - 0.06 * size,
            texts[label.index],
            size=size,
            align="center",
        )


def _draw_plate(
    page: Page, label: Placed, size: tuple[float, float], group: str, *, red: bool
) -> None:
    page.plate(
        (label.u, page.height - label.v),
        size,
        fill=label_fill(GROUP_COLOURS[group]),
        edge=ALARM if red else INK,
        width=0.12 * size[1] if red else 0.06 * size[1],
    )


def label_text(scene: Scene, index: int, colliding: bool) -> str:
    """Return category, score where it is below 1, and a sign of warning for a collision."""
    name = words(CATEGORIES[int(scene.objects.category[index])])
    score = float(scene.objects.score[index])
    sign = "⚠ " if colliding else ""
    return f"{sign}{name}" if score >= 0.995 else f"{sign}{name} {score:.2f}"


def _targets(
    page: Page, curves: Sequence[Curve], texts: Sequence[str], size: float
) -> list[Target]:
    """Return what of each object is seen, around its middle; all of it if nothing is seen."""
    own: dict[int, list[Curve]] = defaultdict(list)
    for curve in curves:
        if curve.kind == "edge":
            own[curve.index].append(curve)
    targets = []
    for index, edges in own.items():
        seen = [edge for edge in edges if edge.visible] or edges
        lonlat = np.concatenate([edge.lonlat for edge in seen])
        lon, lat = lonlat.T
        middle = np.arctan2((np.cos(lat) * np.sin(lon)).sum(), (np.cos(lat) * np.cos(lon)).sum())
        turned = (lon - middle + np.pi) % (2 * np.pi) - np.pi + middle
        u = (turned / (2 * np.pi) + 0.5) * page.width
        v = (0.5 - lat / np.pi) * page.height
        box = np.array([u.min(), v.min(), u.max(), v.max()])
        width, _ = page.text_size(texts[index], size)
        targets.append(Target(index, box, (width + 0.8 * size, 1.42 * size)))
    return targets
