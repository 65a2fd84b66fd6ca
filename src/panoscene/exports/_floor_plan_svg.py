"""Floor plans as SVG, at a scale of architects, for the browser and for paper."""

import os
from collections.abc import Iterable
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

import numpy as np
import shapely
from jaxtyping import Float

from panoscene.exports._floor_plan import FloorPlan, Footprint, floor_plan
from panoscene.exports._plan_dimensions import Dimension
from panoscene.exports._plan_labels import LABEL_MM, LINE, Label
from panoscene.exports._plan_openings import Opening
from panoscene.exports._plan_sheet import KEY_MM, Sheet, make_sheet
from panoscene.scene import Scene, write_atomically
from panoscene.style import FAINT_INK, FLOOR, FONT, GROUP_COLOURS, INK, PAPER, WALL, group_of, words

_STYLE = f"""
    text {{ font-family: "{FONT}", Arial, Helvetica, sans-serif; fill: {INK}; }}
    .floor {{ fill: {FLOOR}; }}
    .wall {{ fill: {WALL}; stroke: {INK}; stroke-width: 0.35; stroke-linejoin: miter; }}
    .opening path, .opening polyline {{ fill: none; stroke: {INK}; stroke-width: 0.2; }}
    .opening .leaf {{ stroke-width: 0.5; }}
    .opening .pane {{ fill: {PAPER}; }}
    .piece polygon {{ stroke: {INK}; stroke-width: 0.25; stroke-linejoin: round;
      fill-opacity: 0.75; }}
    .piece .front {{ stroke: {INK}; stroke-width: 0.7; stroke-linecap: butt; }}
    .overhead polygon {{ stroke-dasharray: 1.2 0.8; fill-opacity: 0.25; }}
    .carpet polygon {{ fill-opacity: 0.3; stroke-width: 0.15; }}
    .label {{ text-anchor: middle; }}
    .number circle {{ fill: {PAPER}; stroke: {INK}; stroke-width: 0.2; }}
    .dimension path {{ fill: none; stroke: {FAINT_INK}; stroke-width: 0.15; }}
    .dimension .tick {{ stroke: {INK}; stroke-width: 0.4; }}
    .dimension text {{ font-size: 2.6px; text-anchor: middle; paint-order: stroke;
      stroke: {PAPER}; stroke-width: 0.6; }}
    .area text {{ text-anchor: middle; }}
    .mark {{ fill: {PAPER}; stroke: {INK}; stroke-width: 0.3; }}
    .dark {{ fill: {INK}; stroke: {INK}; stroke-width: 0.2; }}
    .faint {{ fill: {FAINT_INK}; }}
"""


def write_floor_plan_svg(scene: Scene, path: str | os.PathLike[str]) -> None:
    """Write the floor plan of a scene as SVG; the file appears complete or not at all.

    One user unit is a millimetre on paper, at the scale that the plan names; the attributes
    ``data-metres-per-unit``, ``data-left`` and ``data-top`` of the root lead back to metres.
    Everything has a class, objects have titles, text is text, and nothing is fetched.

    Raises:
        SceneFormatError: the scene has numbers that are not finite or a room that is none.
    """
    plan = floor_plan(scene)
    sheet = make_sheet(plan)
    name = plan.name or "Room"
    width, height = f"{sheet.width:.2f}", f"{sheet.height:.2f}"
    left, top = sheet.origin
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}mm" height="{height}mm" '
        f'viewBox="0 0 {width} {height}" role="img" data-scale="1:{plan.scale}" '
        f'data-metres-per-unit="{plan.metres(1.0):g}" data-left="{left:.4f}" data-top="{top:.4f}">',
        f"  <title>{_text(f'Floor plan of {name}')}</title>",
        f"  <desc>{_text(sheet.summary)}</desc>",
        f"  <style>{_STYLE}  </style>",
        f'  <rect width="{width}" height="{height}" fill="{PAPER}"/>',
        f'  <polygon class="floor" points="{_points(sheet.place(plan.corners))}"/>',
        *_group("furniture", (_piece(sheet, p) for p in plan.furniture if not p.overhead)),
        f'  <path class="wall" fill-rule="evenodd" d="{_area(sheet, plan.walls)}"/>',
        *_group("openings", (_opening(sheet, opening) for opening in plan.openings)),
        *_group("overhead-furniture", (_piece(sheet, p) for p in plan.furniture if p.overhead)),
        *_group("camera", [_camera(sheet, plan)]),
        *_group("labels", (_label(sheet, plan, label) for label in plan.labels)),
        *_group("area", _area_text(sheet, plan)),
        *_group("dimensions", (_dimension(sheet, one) for one in plan.dimensions)),
        *_group("key", _key(sheet, plan)),
        *_group("title-block", _title_block(sheet, plan, name)),
        "</svg>",
    ]
    write_atomically(Path(path), "\n".join(lines) + "\n")


def _group(name: str, parts: Iterable[str]) -> list[str]:
    return [f'  <g class="{name}">', *(f"    {part}" for part in parts), "  </g>"]


def _text(text: str) -> str:
    """Return text as XML, without the characters that XML cannot hold."""
    allowed = (c if " " <= c not in "\ufffe\uffff" else " " for c in text)
    return escape("".join(allowed))


def _points(places: Float[np.ndarray, "points 2"]) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in places.tolist())


def _area(sheet: Sheet, shape: shapely.Geometry) -> str:
    """Return the rings of an area as the data of a path."""
    parts = shapely.get_parts(shape)
    rings = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return " ".join(f"M{_points(sheet.place(np.array(ring.coords)[:-1]))}Z" for ring in rings)


def _write(
    place: tuple[float, float],
    text: str,
    size: float,
    *,
    kind: str = "",
    rotation: float = 0.0,
    bold: bool = False,
) -> str:
    """Return a line of text; the place is the middle of its height."""
    x, y = place[0], place[1] + 0.35 * size
    turn = f' transform="rotate({rotation:.2f} {place[0]:.2f} {place[1]:.2f})"' if rotation else ""
    weight = ' font-weight="bold"' if bold else ""
    look = f' class="{kind}"' if kind else ""
    return (
        f'<text x="{x:.2f}" y="{y:.2f}" font-size="{size:.2f}"{look}{weight}{turn}>'
        f"{_text(text)}</text>"
    )


def _piece(sheet: Sheet, piece: Footprint) -> str:
    corners = sheet.place(piece.corners)
    kinds = ["piece", piece.category, group_of(piece.category).replace(" ", "-")]
    kinds += ["overhead"] if piece.overhead else []
    parts = [f"<title>{_text(f'{piece.name}: {words(piece.category)}')}</title>"]
    colour = GROUP_COLOURS[group_of(piece.category)]
    parts.append(f'<polygon points="{_points(corners)}" fill="{colour}"/>')
    depth = float(np.linalg.norm(corners[3] - corners[0]))
    if piece.has_front and depth > 1.2:
        inset = 0.35 * (corners[[0, 1]] - corners[[3, 2]]) / depth
        ends = corners[[3, 2]] + inset
        parts.append(f'<path class="front" d="M{_points(ends)}"/>')
    return f"<g class={quoteattr(' '.join(kinds))}>{''.join(parts)}</g>"


def _opening(sheet: Sheet, opening: Opening) -> str:
    title = f"<title>{_text(f'{opening.name}: {opening.kind}, {opening.width:.2f} m')}</title>"
    if opening.kind == "window":
        frame = np.concatenate([opening.line(0.0), opening.line(1.0)[::-1]])
        parts = [f'<path class="pane" d="M{_points(sheet.place(frame))}Z"/>']
        panes = [opening.line(share) for share in (0.4, 0.6)]
        parts += [f'<path d="M{_points(sheet.place(pane))}"/>' for pane in panes]
    else:
        parts = []
        for leaf in opening.leaves:
            open_leaf = sheet.place(np.stack([leaf.hinge, leaf.tip]))
            parts.append(f'<path class="leaf" d="M{_points(open_leaf)}"/>')
            parts.append(f'<polyline points="{_points(sheet.place(leaf.arc()))}"/>')
    return f'<g class="opening {opening.kind}">{title}{"".join(parts)}</g>'


def _camera(sheet: Sheet, plan: FloorPlan) -> str:
    x, y = sheet.place(np.array([plan.camera]))[0].tolist()
    return (
        f'<g><title>where the photo was taken</title><circle class="mark" cx="{x:.2f}" '
        f'cy="{y:.2f}" r="1.3"/><circle class="dark" cx="{x:.2f}" cy="{y:.2f}" r="0.4"/></g>'
    )


def _label(sheet: Sheet, plan: FloorPlan, label: Label) -> str:
    x, y = sheet.place(np.array([label.place]))[0].tolist()
    size = label.size / plan.metres(1.0)
    if label.number is not None:
        circle = f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{0.85 * size:.2f}"/>'
        return f'<g class="label number">{circle}{_write((x, y), label.text[0], size)}</g>'
    lines: list[str] = []
    for k, line in enumerate(label.text):
        shift = (k - (len(label.text) - 1) / 2) * LINE * size
        place = (x + shift, y) if label.upright else (x, y + shift)
        rotation = -90.0 if label.upright else 0.0
        lines.append(_write(place, line, size, kind="label", rotation=rotation))
    return "".join(lines)


def _area_text(sheet: Sheet, plan: FloorPlan) -> list[str]:
    x, y = sheet.place(np.array([plan.area_place]))[0].tolist()
    return [
        _write((x, y - 2.0), f"{plan.area:.1f} m²", 4.2, bold=True),
        _write((x, y + 2.2), f"height {plan.height:.2f} m", 2.6, kind="faint"),
    ]


def _dimension(sheet: Sheet, dimension: Dimension) -> str:
    start, end = sheet.place(dimension.line)
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    paths: list[str] = []
    for foot, head in zip(
        sheet.place(np.stack([dimension.start, dimension.end])), (start, end), strict=True
    ):
        out = (head - foot) / max(float(np.linalg.norm(head - foot)), 1e-9)
        paths.append(f'<path d="M{_points(np.stack([head - 4.0 * out, head + 1.5 * out]))}"/>')
        slash = np.array([along[0] + along[1], along[1] - along[0]]) * 0.8
        ends = _points(np.stack([head - slash, head + slash]))
        paths.append(f'<path class="tick" d="M{ends}"/>')
    paths.append(f'<path d="M{_points(np.stack([start - along, end + along]))}"/>')
    rotation, place, size = sheet.dimension_text(dimension)
    text = _write(place, dimension.text, size, rotation=rotation)
    return f'<g class="dimension">{"".join(paths)}{text}</g>'


def _key(sheet: Sheet, plan: FloorPlan) -> list[str]:
    x, top = sheet.key_place
    lines: list[str] = []
    for k, name in enumerate(plan.key):
        y = top + k * KEY_MM
        circle = f'<circle cx="{x + 2:.2f}" cy="{y:.2f}" r="1.95"/>'
        number = _write((x + 2, y), str(k + 1), 2.3)
        lines.append(f'<g class="label number">{circle}{number}</g>')
        lines.append(_write((x + 6, y), name, LABEL_MM))
    return lines


def _title_block(sheet: Sheet, plan: FloorPlan, name: str) -> list[str]:
    x, y = sheet.block_place
    lines = [_write((x, y), name, 4.6, bold=True), _write((x, y + 5.6), sheet.summary, 2.6)]
    bar, metres = sheet.bar
    for k in range(2):
        kind, left = ("dark", "mark")[k], bar[0] + k * sheet.bar_mm / 2
        lines.append(
            f'<rect class="{kind}" x="{left:.2f}" y="{bar[1] - 0.6:.2f}" '
            f'width="{sheet.bar_mm / 2:.2f}" height="1.2"/>'
        )
    lines.append(_write((bar[0] + sheet.bar_mm + 2, bar[1]), f"{metres:g} m", 2.6))
    tail, tip = sheet.arrow(plan)
    ahead = (tip - tail) / float(np.linalg.norm(tip - tail))
    side = np.array([-ahead[1], ahead[0]])
    head = np.stack([tip, tip - 3.0 * ahead + 1.3 * side, tip - 3.0 * ahead - 1.3 * side])
    lines.append(f'<path class="dark" d="M{_points(np.stack([tail, tip - ahead]))}"/>')
    lines.append(f'<polygon class="dark" points="{_points(head)}"/>')
    lines.append(_write(sheet.arrow_text, "photo's centre", 2.6))
    return lines
