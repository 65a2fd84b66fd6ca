"""One room on the page: floor, walls, objects, marks, labels, dimensions."""

import numpy as np
import shapely

from panoscene.geometry import box_footprint
from panoscene.scene import Scene
from panoscene.style import (
    ALARM,
    CONTACT,
    CONTACT_RIM,
    CONTACT_WIDTH,
    FAINT_INK,
    FLOOR,
    FRONT,
    GROUP_COLOURS,
    HEAVY,
    INK,
    LABEL,
    LEADER,
    NO_FRONT,
    OPAQUE,
    OUTLINE,
    PAPER,
    REFERENCE,
    SEE_THROUGH,
    SMALL,
    THIN,
    WALL,
    group_of,
)
from panoscene.views._labels import Label
from panoscene.views._page import Page
from panoscene.views._pieces import Bounds, Contact, Piece, Plan, View

DIMENSION_GAP = 34.0
"""Pixels between what is drawn and the dimension lines."""


def draw_room(page: Page, plan: Plan, reference: Scene | None, view: View) -> None:
    """Draw everything but text: room, objects, true places, collisions, contacts, camera."""
    page.area(plan.floor, fill=FLOOR)
    page.area(plan.walls, fill=WALL)
    for piece in plan.pieces:
        draw_piece(page, piece)
    if reference is not None:
        for corners in view.page(box_footprint(reference.objects.boxes).double().numpy(force=True)):
            page.area(shapely.Polygon(corners), edge=REFERENCE, width=1.2, dashes=(4.0, 2.5))
    for clash in plan.clashes:
        draw_alarm(page, clash)
    for piece in plan.pieces:
        draw_alarm(page, piece.outside)
    for contact in plan.contacts:
        draw_contact(page, contact, plan.thinner)
    draw_camera(page, plan.camera)


def draw_piece(page: Page, piece: Piece) -> None:
    """Draw one object: fill, outline, front."""
    red = piece.colliding or piece.outside.area > 0
    page.area(
        piece.footprint,
        fill=GROUP_COLOURS[group_of(piece.category)],
        edge=ALARM if red else INK,
        width=HEAVY if red else OUTLINE,
        dashes=(5.0, 3.0) if piece.overhead else None,
        alpha=SEE_THROUGH if piece.overhead or piece.category == "carpet" else OPAQUE,
    )
    if piece.category not in NO_FRONT:
        draw_front(page, piece)


def draw_front(page: Page, piece: Piece) -> None:
    """Draw a bar along the front, and a tip that points where the object faces."""
    width, depth = piece.extent
    if width < 1e-6:
        return
    page.line(piece.front, width=min(FRONT, max(1.5, 0.4 * depth)), colour=INK)
    page.area(piece.tip, fill=INK)


def draw_alarm(page: Page, shape: shapely.Geometry) -> None:
    """Draw what must not be: hatched in red."""
    page.area(shape, fill=ALARM, alpha=0.22)
    page.area(shape, edge=ALARM, width=OUTLINE, hatch="/////")


def draw_contact(page: Page, contact: Contact, thinner: float = 1.0) -> None:
    """Draw a touching relation: white with a dark rim, finer in plans of small scale."""
    if np.allclose(contact.start, contact.end):
        page.disc(contact.start, 3.6 * thinner, fill=CONTACT, edge=INK, width=CONTACT_RIM)
        return
    ends = [contact.start, contact.end]
    page.line(ends, colour=INK, width=CONTACT_WIDTH * thinner + 2 * CONTACT_RIM, cap="round")
    page.line(ends, colour=CONTACT, width=CONTACT_WIDTH * thinner, cap="round")


def draw_camera(page: Page, place: np.ndarray) -> None:
    """Draw where the photo was taken."""
    page.disc(place, 8.0, fill=PAPER, edge=INK, width=2.0)
    page.disc(place, 3.0, fill=INK, edge=INK, width=0.5)


def draw_labels(page: Page, labels: dict[int, Label]) -> None:
    """Write names and numbers, with their leaders."""
    for label in labels.values():
        if label.leader is not None:
            page.line(label.leader, colour=PAPER, width=3.0)
            page.line(label.leader, colour=LEADER, width=THIN)
    for label in labels.values():
        page.text(
            label.x,
            label.y,
            label.text,
            size=LABEL,
            align="center",
            rotation=label.rotation,
            halo=PAPER,
        )


def dimension_shapes(plan: Plan, content: Bounds) -> list[shapely.Polygon]:
    """Return the strips below and to the left of the content that the dimensions take."""
    left, low, right, high = plan.floor.bounds
    y, x = content[1] - DIMENSION_GAP, content[0] - DIMENSION_GAP
    return [
        shapely.box(left - 6, y - 9, right + 6, y + 9),
        shapely.box(x - 9, low - 6, x + 9, high + 6),
    ]


def draw_dimensions(page: Page, plan: Plan, content: Bounds, scale: float) -> None:
    """Draw width and depth of the room below and to the left of everything else."""
    for strip, rotation in zip(dimension_shapes(plan, content), (0.0, 90.0), strict=True):
        x, y = strip.centroid.coords[0]
        left, low, right, high = strip.bounds
        ends = ((x, low + 6), (x, high - 6)) if rotation else ((left + 6, y), (right - 6, y))
        page.line(ends, colour=FAINT_INK, width=THIN)
        for end in ends:
            tick = np.array([4.0, 4.0])
            page.line([end - tick, end + tick], colour=FAINT_INK, width=1.6)
        text = f"{shapely.LineString(ends).length / scale:.2f} m"
        width, height = page.text_size(text, SMALL)
        half = np.array([height, width] if rotation else [width, height]) / 2 + 5
        page.area(shapely.box(x - half[0], y - half[1], x + half[0], y + half[1]), fill=PAPER)
        page.text(x, y, text, size=SMALL, colour=FAINT_INK, align="center", rotation=rotation)


def draw_scale(page: Page, x: float, y: float, scale: float, turn: float) -> None:
    """Draw a scale bar that starts at (x, y), and the direction of the photo's centre."""
    metres = next((m for m in (1, 2, 5, 10, 20, 50, 100) if m * scale >= 60), 200)
    length = metres * scale
    page.area(shapely.box(x, y - 3, x + length / 2, y + 3), fill=INK, edge=INK, width=THIN)
    page.area(shapely.box(x + length / 2, y - 3, x + length, y + 3), edge=INK, width=THIN)
    page.text(x + length + 8, y, f"{metres} m", size=SMALL, colour=FAINT_INK)
    arrow = np.array([x + length + 76, y])
    forward = np.array([-np.sin(turn), np.cos(turn)])
    side = np.array([forward[1], -forward[0]])
    tip = arrow + 13 * forward
    page.line([arrow - 13 * forward, tip - 6 * forward], colour=INK, width=2.0)
    wings = [tip - 9 * forward + 5 * side, tip - 9 * forward - 5 * side]
    page.area(shapely.Polygon([tip, *wings]), fill=INK)
    page.text(arrow[0] + 20, y, "+y, photo's centre", size=SMALL, colour=FAINT_INK)
