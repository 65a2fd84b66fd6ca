"""What a floor plan is in ezdxf's words."""

import io
import math

import numpy as np
import shapely
from ezdxf import units
from ezdxf.document import Drawing
from ezdxf.enums import InsertUnits, TextEntityAlignment
from ezdxf.filemanagement import new
from ezdxf.layouts.layout import Modelspace
from jaxtyping import Float

from panoscene.exports._floor_plan import FloorPlan, Footprint
from panoscene.exports._plan_dimensions import Dimension
from panoscene.exports._plan_labels import LINE
from panoscene.exports._plan_openings import Opening
from panoscene.style import FAINT_INK, GROUP_COLOURS, INK, WALL, group_of

_LAYERS = {
    # name: colour, line type, line weight in hundredths of a millimetre
    "WALLS": (INK, "Continuous", 50),
    "WALLS-FILL": (WALL, "Continuous", 0),
    "DOORS": (INK, "Continuous", 35),
    "WINDOWS": (INK, "Continuous", 18),
    "FURNITURE": (INK, "Continuous", 25),
    "FURNITURE-OVERHEAD": (INK, "DASHED", 18),
    "FURNITURE-FILL": (FAINT_INK, "Continuous", 0),
    "DIMENSIONS": (FAINT_INK, "Continuous", 13),
    "TEXT": (INK, "Continuous", 18),
    "CAMERA": (FAINT_INK, "Continuous", 18),
}
_DIMENSION_STYLE = "PLAN"
_FONT = "PLAN"
_MIDDLE = TextEntityAlignment.MIDDLE_CENTER


def dxf_text(plan: FloorPlan) -> str:
    """Return a floor plan as the text of a DXF file (R2010)."""
    drawing = _drawing(plan)
    space = drawing.modelspace()
    _draw_walls(space, plan.walls)
    for opening in plan.openings:
        _draw_opening(space, opening)
    for piece in plan.furniture:
        _draw_piece(drawing, piece)
    for dimension in plan.dimensions:
        _draw_dimension(space, dimension)
    _draw_texts(space, plan)
    _draw_camera(space, plan)
    left, bottom, right, top = plan.bounds
    drawing.set_modelspace_vport(
        height=1.1 * max(top - bottom, (right - left) / 1.5),
        center=((left + right) / 2, (bottom + top) / 2),
    )
    stream = io.StringIO()
    drawing.write(stream)
    return stream.getvalue()


def _drawing(plan: FloorPlan) -> Drawing:
    """Return an empty drawing in metres, with layers and styles."""
    drawing = new("R2010", setup=["linetypes"], units=units.M)
    drawing.header["$MEASUREMENT"] = 1
    drawing.appids.add("PANOSCENE")
    drawing.header["$LUNITS"] = 2
    drawing.header["$LTSCALE"] = plan.metres(6.0)
    for name, (colour, line_type, weight) in _LAYERS.items():
        layer = drawing.layers.add(name, linetype=line_type, lineweight=weight)
        layer.rgb = _rgb(colour)
    drawing.styles.add(_FONT, font="DejaVuSans.ttf")
    style = drawing.dimstyles.new(_DIMENSION_STYLE)
    size = 0.72 * plan.metres(2.6)
    style.dxf.dimtxsty = _FONT
    style.dxf.dimtxt = size
    style.dxf.dimtsz = size / 2  # slashes, as architects use
    style.dxf.dimasz = size / 2
    style.dxf.dimexo = plan.metres(5.0)
    style.dxf.dimexe = plan.metres(1.5)
    style.dxf.dimgap = plan.metres(0.6)
    style.dxf.dimclrd = style.dxf.dimclre = style.dxf.dimclrt = 256  # the layer's
    style.dxf.dimtad = 1
    style.dxf.dimtih = 0
    style.dxf.dimtoh = 0
    style.dxf.dimdec = 2
    style.dxf.dimzin = 0
    style.dxf.dimlunit = 2
    style.dxf.dimdsep = ord(".")
    style.dxf.dimtmove = 2
    return drawing


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


def _draw_walls(space: Modelspace, walls: shapely.Geometry) -> None:
    for part in shapely.get_parts(walls):
        hatch = space.add_hatch(dxfattribs={"layer": "WALLS-FILL"})
        hatch.rgb = _rgb(WALL)
        for k, ring in enumerate((part.exterior, *part.interiors)):
            places = [(x, y) for x, y in list(ring.coords)[:-1]]
            hatch.paths.add_polyline_path(places, is_closed=True, flags=0 if k else 1)
            space.add_lwpolyline(places, close=True, dxfattribs={"layer": "WALLS"})


def _draw_opening(space: Modelspace, opening: Opening) -> None:
    if opening.kind == "window":
        frame = [*opening.line(0.0).tolist(), *opening.line(1.0)[::-1].tolist()]
        space.add_lwpolyline(frame, close=True, dxfattribs={"layer": "WINDOWS"})
        for share in (0.4, 0.6):
            start, end = opening.line(share).tolist()
            space.add_line(start, end, dxfattribs={"layer": "WINDOWS"})
    for leaf in opening.leaves:
        space.add_line(leaf.hinge.tolist(), leaf.tip.tolist(), dxfattribs={"layer": "DOORS"})
        angles = [
            math.degrees(math.atan2(*(place - leaf.hinge)[::-1]))
            for place in (leaf.closed, leaf.tip)
        ]
        # an arc runs counter-clockwise
        if (angles[1] - angles[0]) % 360 > 180:
            angles.reverse()
        radius = float(np.linalg.norm(leaf.tip - leaf.hinge))
        space.add_arc(
            leaf.hinge.tolist(), radius, angles[0], angles[1], dxfattribs={"layer": "DOORS"}
        )


def _draw_piece(drawing: Drawing, piece: Footprint) -> None:
    middle = piece.corners.mean(0)
    right, up = piece.corners[1] - piece.corners[0], piece.corners[3] - piece.corners[0]
    x, y = float(np.linalg.norm(right)) / 2, float(np.linalg.norm(up)) / 2
    layer = "FURNITURE-OVERHEAD" if piece.overhead else "FURNITURE"
    block = drawing.blocks.new(f"{piece.index}-{piece.category}")
    block.units = InsertUnits.Meters
    outline = [(-x, -y), (x, -y), (x, y), (-x, y)]
    if not piece.overhead and piece.category != "carpet":
        fill = block.add_hatch(dxfattribs={"layer": "FURNITURE-FILL"})
        fill.rgb = _rgb(GROUP_COLOURS[group_of(piece.category)])
        fill.transparency = 0.4
        fill.paths.add_polyline_path(outline, is_closed=True)
    block.add_lwpolyline(outline, close=True, dxfattribs={"layer": layer})
    if piece.has_front and y > 0.03:
        inset = min(0.04, y / 4)
        ends = [(-x, y - inset), (x, y - inset)]
        front = block.add_lwpolyline(ends, dxfattribs={"layer": layer})
        front.dxf.const_width = min(0.03, y / 4)
    turn = math.degrees(math.atan2(right[1], right[0]))
    insert = drawing.modelspace().add_blockref(
        block.name, middle.tolist(), dxfattribs={"layer": layer, "rotation": turn}
    )
    insert.set_xdata("PANOSCENE", [(1000, piece.name), (1000, piece.category)])


def _draw_dimension(space: Modelspace, dimension: Dimension) -> None:
    measured, line = np.stack([dimension.start, dimension.end]), dimension.line
    along = line[1] - line[0]
    # from left to right or from below upwards, so that texts read from below or from the right
    if along[0] < -1e-6 or (abs(along[0]) <= 1e-6 and along[1] < 0):
        measured, line, along = measured[::-1], line[::-1], -along
    space.add_linear_dim(
        base=line[0].tolist(),
        p1=measured[0].tolist(),
        p2=measured[1].tolist(),
        angle=math.degrees(math.atan2(along[1], along[0])),
        dimstyle=_DIMENSION_STYLE,
        dxfattribs={"layer": "DIMENSIONS"},
    ).render()


def _draw_texts(space: Modelspace, plan: FloorPlan) -> None:
    def write(text: str, place: tuple[float, float], size: float, turn: float = 0.0) -> None:
        attributes = {"layer": "TEXT", "style": _FONT, "rotation": turn}
        entity = space.add_text(text, height=0.72 * size, dxfattribs=attributes)
        entity.set_placement(place, align=_MIDDLE)

    for label in plan.labels:
        x, y = label.place
        if label.number is not None:
            space.add_circle((x, y), 0.85 * label.size, dxfattribs={"layer": "TEXT"})
        for k, line in enumerate(label.text):
            shift = (k - (len(label.text) - 1) / 2) * LINE * label.size
            place = (x + shift, y) if label.upright else (x, y - shift)
            write(line, place, label.size, 90.0 if label.upright else 0.0)
    x, y = plan.area_place
    write(f"{plan.area:.1f} m²", (x, y + plan.metres(2.0)), plan.metres(4.2))
    write(f"height {plan.height:.2f} m", (x, y - plan.metres(2.2)), plan.metres(2.6))
    left, bottom, right, top = plan.bounds
    lines = [plan.name or "Room", f"1:{plan.scale}, dimensions in metres, inner faces of walls"]
    lines += [f"{k + 1}  {name}" for k, name in enumerate(plan.key)]
    places = [(left, bottom - plan.metres(5.0)), (left, bottom - plan.metres(11.0))]
    places += [
        (right + plan.metres(6.0), top - plan.metres(8.0 + 5 * k)) for k in range(len(plan.key))
    ]
    for k, (line, place) in enumerate(zip(lines, places, strict=True)):
        size = plan.metres(4.6 if k == 0 else 2.8)
        attributes = {"layer": "TEXT", "style": _FONT}
        entity = space.add_text(line, height=0.72 * size, dxfattribs=attributes)
        entity.set_placement(place, align=TextEntityAlignment.MIDDLE_LEFT)


def _draw_camera(space: Modelspace, plan: FloorPlan) -> None:
    layer = {"layer": "CAMERA"}
    camera = np.array(plan.camera)
    space.add_circle(camera.tolist(), plan.metres(1.3), dxfattribs=layer)
    space.add_point(camera.tolist(), dxfattribs=layer)
    ahead = np.array(plan.ahead)
    side = np.array([-ahead[1], ahead[0]])
    tip = camera + plan.metres(9.0) * ahead
    _arrow(space, camera + plan.metres(1.3) * ahead, tip, side * plan.metres(1.0), layer)


def _arrow(
    space: Modelspace,
    tail: Float[np.ndarray, " 2"],
    tip: Float[np.ndarray, " 2"],
    side: Float[np.ndarray, " 2"],
    attributes: dict[str, str],
) -> None:
    back = tail + 0.65 * (tip - tail)
    space.add_line(tail.tolist(), tip.tolist(), dxfattribs=attributes)
    head = [(back + side).tolist(), tip.tolist(), (back - side).tolist()]
    space.add_lwpolyline(head, dxfattribs=attributes)
