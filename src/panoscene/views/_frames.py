"""One frame of the moving picture: from above, in space, and where the solver stands."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from jaxtyping import Float
from PIL import Image, ImageDraw

from panoscene.geometry import OrientedBoxes, box_footprint
from panoscene.scene import CATEGORIES, Scene
from panoscene.style import (
    ALARM,
    CONTACT_WIDTH,
    FAINT_INK,
    FLOOR,
    GROUP_COLOURS,
    INK,
    NO_FRONT,
    OPAQUE,
    OVERHEAD,
    PAPER,
    REFERENCE,
    SEE_THROUGH,
    WALL,
    WALL_THICKNESS,
    group_of,
)
from panoscene.views._attachments import (
    Joints,
    clashes,
    footprints,
    level_contacts,
    object_contacts,
    wall_contacts,
)
from panoscene.views._cameras import FreeCamera, free_lens
from panoscene.views._canvas import Canvas, font
from panoscene.views._image_files import picture_from_image
from panoscene.views._model import build_model
from panoscene.views._painter import Shade
from panoscene.views._pieces import colliding_pairs
from panoscene.views._render import render_model

HEADER, FOOTER = 46, 64
_MARGIN = 22
_RAYS = 4
"""Occlusion rays."""


@dataclass(frozen=True, slots=True)
class Stage:
    """What stays the same in all frames."""

    scene: Scene
    joints: Joints
    reference: OrientedBoxes | None
    camera: FreeCamera
    turn: float
    """Radians, counter-clockwise, by which the room is turned in the view from above."""
    size_px: tuple[int, int]
    energies: tuple[float, ...] = ()
    """Of all frames."""

    @property
    def panels(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Width and height of the view from above and of the view in space."""
        width, height = self.size_px
        left = round(0.44 * width)
        tall = max(1, height - HEADER - FOOTER)
        return (left, tall), (max(1, width - left), tall)


def draw_frame(stage: Stage, boxes: OrientedBoxes, number: int, title: str) -> Image.Image:
    """Return a frame.

    Args:
        stage: what stays the same.
        boxes: of this frame.
        number: of this frame, from 0, for the curve.
        title: heading.
    """
    pairs = colliding_pairs(replace(stage.scene.objects, boxes=boxes))
    picture = Image.new("RGB", stage.size_px, PAPER)
    left, right = stage.panels
    _draw_above(stage, boxes, pairs, left).onto(picture, 0, HEADER)
    picture.paste(_draw_space(stage, boxes, pairs, right), (left[0], HEADER))
    draw = ImageDraw.Draw(picture)
    draw.text((_MARGIN, HEADER / 2 + 2), title, fill=INK, font=font(18.0, bold=True), anchor="lm")
    count = len(pairs)
    # from a centimetre, as hatched; certificates count collisions from ten
    words = {0: "nothing overlaps", 1: "1 pair overlaps"}.get(count, f"{count} pairs overlap")
    place = (stage.size_px[0] - _MARGIN, HEADER / 2 + 2)
    draw.text(place, words, fill=ALARM if count else INK, font=font(18.0, bold=True), anchor="rm")
    _draw_curve(picture, stage, number)
    return picture


def _draw_above(
    stage: Stage, boxes: OrientedBoxes, pairs: np.ndarray, size: tuple[int, int]
) -> Canvas:
    """Return the room from above, in the style of the bird's-eye view."""
    canvas = Canvas(*size)
    polygon = stage.scene.layout.floor_polygon.double().numpy(force=True)
    page = _Page(polygon, stage.turn, size)
    floor = shapely.Polygon(page.pixels(polygon))
    thick = WALL_THICKNESS * page.scale
    canvas.polygon(floor.buffer(thick, join_style="mitre", mitre_limit=3.0), fill=WALL)
    canvas.polygon(floor, fill=FLOOR)
    colliding = set(pairs.flatten().tolist())
    shapes = [shapely.Polygon(page.pixels(np.array(s.exterior.coords))) for s in footprints(boxes)]
    corners = page.pixels(box_footprint(boxes).double().numpy(force=True))
    top = (boxes.centre[:, 2] + boxes.size[:, 2] / 2).tolist()
    bottom = (boxes.centre[:, 2] - boxes.size[:, 2] / 2 - stage.scene.layout.floor_height).tolist()
    names = [CATEGORIES[k] for k in stage.scene.objects.category.tolist()]
    for k in sorted(range(len(shapes)), key=lambda k: (bottom[k] > OVERHEAD, top[k])):
        faint = bottom[k] > OVERHEAD or names[k] == "carpet"
        canvas.polygon(
            shapes[k],
            fill=GROUP_COLOURS[group_of(names[k])],
            opacity=SEE_THROUGH if faint else OPAQUE,
            edge=ALARM if k in colliding else INK,
            width=2.2 if k in colliding else 1.2,
        )
        if names[k] not in NO_FRONT:
            canvas.line(corners[k][[3, 2]], INK, 3.0)
    if stage.reference is not None:
        for ring in box_footprint(stage.reference).double().numpy(force=True):
            canvas.dashes(page.pixels(ring)[[0, 1, 2, 3, 0]], REFERENCE, 1.2)
    grown = floor.buffer(0.01 * page.scale, join_style="mitre")
    outside = [shape.difference(floor) for shape in shapes if not shape.within(grown)]
    shared = [
        shapely.Polygon(page.pixels(np.array(clash.footprint.exterior.coords)))
        for clash in clashes(boxes, pairs)
    ]
    parts = [part for shape in outside for part in shapely.get_parts(shape).tolist()]
    canvas.hatch(shared + [part for part in parts if isinstance(part, shapely.Polygon)])
    lines = np.concatenate([
        object_contacts(boxes, stage.joints),
        wall_contacts(boxes, stage.scene.layout, stage.joints),
    ])  # fmt: skip
    for start, end in page.pixels(lines[..., :2]):
        canvas.contact(start, end, 0.8 * CONTACT_WIDTH * _finer(stage))
    return canvas


def _draw_space(
    stage: Stage, boxes: OrientedBoxes, pairs: np.ndarray, size: tuple[int, int]
) -> Image.Image:
    """Return the room in space; collisions and contacts are drawn over what hides them."""
    scene = replace(stage.scene, objects=replace(stage.scene.objects, boxes=boxes))
    lens = free_lens(stage.camera, size)
    model = build_model(scene, lens.eye, cut=True)
    alarmed = frozenset(pairs.flatten().tolist())
    shade = Shade(_RAYS, True, None, scene.panorama.camera_height, alarmed)
    picture = picture_from_image(render_model(model, lens, shade))
    canvas = Canvas(*size)
    hulls = [_hull(lens.pixels(clash.corners)) for clash in clashes(boxes, pairs)]
    canvas.hatch([hull for hull in hulls if isinstance(hull, shapely.Polygon)])
    joints = stage.joints.among(np.unique(model.item[model.item >= 0]))
    lines = np.concatenate([
        object_contacts(boxes, joints),
        wall_contacts(boxes, scene.layout, joints),
        level_contacts(boxes, scene.layout, joints, lens.eye),
    ])  # fmt: skip
    pixels, ahead = lens.pixels(lines)
    for (start, end), depth in zip(pixels, ahead, strict=True):
        if depth.min() > 0.1:
            canvas.contact(start, end, 0.8 * CONTACT_WIDTH * _finer(stage))
    canvas.onto(picture, 0, 0)
    return picture


def _finer(stage: Stage) -> float:
    """Return the width of attachments as a share of the usual: they must not hide the furniture."""
    return min(1.0, max(0.6, stage.size_px[0] / 1080))


def _hull(
    projected: tuple[Float[np.ndarray, "corners 2"], Float[np.ndarray, " corners"]],
) -> shapely.Geometry:
    pixels, ahead = projected
    return shapely.MultiPoint(pixels if ahead.min() > 0.1 else pixels[:0]).convex_hull


def _draw_curve(picture: Image.Image, stage: Stage, number: int) -> None:
    """Draw the energy of all frames, and where this one is."""
    width, height = picture.size
    canvas = Canvas(width, FOOTER)
    energy = np.array(stage.energies)
    left, right, top, bottom = 120.0, width - 430.0, 12.0, FOOTER - 16.0
    draw = ImageDraw.Draw(picture)
    text = f"energy {energy[number]:.2f}"
    draw.text((_MARGIN, height - FOOTER / 2), text, fill=FAINT_INK, font=font(13.0), anchor="lm")
    if right - left > 60:
        share = np.arange(len(energy)) / max(len(energy) - 1, 1)
        rise = (energy - energy.min()) / max(float(np.ptp(energy)), 1e-12)
        curve = np.column_stack([left + 20 + share * (right - left - 20),
                                 bottom - rise * (bottom - top)])  # fmt: skip
        canvas.line(np.array([[left + 20, bottom + 4], [right, bottom + 4]]), "#c9cdd2", 1.0)
        canvas.line(curve, "#b4b9c0", 1.6)
        canvas.line(curve[: number + 1] if number else curve[[0, 0]], INK, 2.0)
        dot = shapely.Point(curve[number]).buffer(4.0)
        canvas.polygon(dot, fill=INK)
        _draw_key(canvas, draw, stage, right + 30, height)
    canvas.onto(picture, 0, height - FOOTER)


def _draw_key(
    canvas: Canvas, draw: ImageDraw.ImageDraw, stage: Stage, x: float, height: int
) -> None:
    """Draw what the signs mean."""
    middle = FOOTER / 2
    rows: Sequence[tuple[str, float]] = (("overlap", 115.0), ("attachment", 140.0))
    if stage.reference is not None:
        rows = (*rows, ("truth", 80.0))
    for name, wide in rows:
        if name == "overlap":
            canvas.hatch([shapely.box(x, middle - 8, x + 24, middle + 8)])
        elif name == "attachment":
            canvas.contact(np.array([x + 4, middle]), np.array([x + 22, middle]), 3.6)
        else:
            corners = np.array(shapely.box(x, middle - 7, x + 22, middle + 7).exterior.coords)
            canvas.dashes(corners, REFERENCE, 1.2)
        place = (x + 32, height - FOOTER / 2)
        draw.text(place, name, fill=FAINT_INK, font=font(13.0), anchor="lm")
        x += wide


class _Page:
    """Where the world lies in the view from above."""

    def __init__(
        self, polygon: Float[np.ndarray, "corners 2"], turn: float, size: tuple[int, int]
    ) -> None:
        sine, cosine = np.sin(turn), np.cos(turn)
        self._turn = np.array([[cosine, -sine], [sine, cosine]])
        turned = polygon @ self._turn.T
        low, high = turned.min(0), turned.max(0)
        free = np.maximum(np.array(size) - 2 * _MARGIN - 12, 1)
        self.scale = float((free / np.maximum(high - low, 1e-6)).min())
        self._middle, self._centre = (low + high) / 2, np.array(size) / 2

    def pixels(self, points: Float[np.ndarray, "*points 2"]) -> Float[np.ndarray, "*points 2"]:
        """Return world points as pixels of the panel."""
        offset = (points @ self._turn.T - self._middle) * self.scale
        return self._centre + offset * np.array([1.0, -1.0])
