"""Floor plans: openings, dimensions, labels; SVG and DXF as their readers see them."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
import shapely
import torch
from ezdxf.entities.dimension import Dimension
from ezdxf.entities.insert import Insert
from ezdxf.entities.lwpolyline import LWPolyline
from ezdxf.filemanagement import readfile

from panoscene.exports import floor_plan, write_floor_plan_dxf, write_floor_plan_svg
from panoscene.scene import Layout, Scene, SceneFormatError
from panoscene.synth import sample_room

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("turn", [0.0, 0.4, -0.7, math.pi / 2, 2.0])
def test_plans_of_turned_rooms_are_upright_and_alike(
    turned_room: Callable[[float], Scene], turn: float
) -> None:
    plan = floor_plan(turned_room(turn))
    assert abs(plan.turn) <= math.pi / 4 + 1e-6
    along = np.roll(plan.corners, -1, axis=0) - plan.corners
    assert np.abs(along).min(axis=1) == pytest.approx(0, abs=1e-5)
    # of the wall with the door: 2 + 5 m, and its opening between 0.85 and 1.75 m
    door, window = plan.openings
    assert (door.kind, door.wall, window.kind, window.wall) == ("door", 0, "window", 1)
    assert (door.start, door.end) == pytest.approx((0.85, 1.75), abs=1e-5)
    assert (window.start, window.end) == pytest.approx((1.9, 3.1), abs=1e-5)
    walls = {d.wall: d.length for d in plan.dimensions if d.wall is not None}
    assert walls == pytest.approx({0: 5.0, 1: 4.0, 2: 5.0, 3: 4.0}, abs=1e-5)
    assert {p.category for p in plan.furniture} == {"bed", "floor_lamp"}
    assert plan.area == pytest.approx(20.0, abs=1e-4)
    assert [piece.overhead for piece in plan.furniture] == [False, True]
    ahead = np.array([-math.sin(plan.turn), math.cos(plan.turn)])
    assert plan.ahead == pytest.approx(tuple(ahead))


def test_dimensions_of_a_wall_with_an_opening(room: Scene) -> None:
    plan = floor_plan(room)
    south = [d for d in plan.dimensions if d.line[:, 1].max() < -1.0]
    assert [d.text for d in south] == ["0.85", "0.90", "3.25", "5.00"]
    for d in plan.dimensions:
        offset = d.line - np.stack([d.start, d.end])
        assert offset[0] == pytest.approx(offset[1])
        # outside, and at a right angle
        assert abs(float(offset[0] @ (d.end - d.start))) < 1e-6
        middle = shapely.Point(d.line.mean(0))
        assert not shapely.Polygon(plan.corners).contains(middle)


def test_walls_have_gaps_at_openings(room: Scene) -> None:
    plan = floor_plan(room)
    thickness = 0.12
    solid = (5 + 2 * thickness) * (4 + 2 * thickness) - 20
    gaps = thickness * (0.9 + 1.2)
    assert shapely.area(plan.walls) == pytest.approx(solid - gaps, abs=1e-5)
    (leaf,) = plan.openings[0].leaves
    # hinged next to the nearer corner, open into the room
    assert leaf.hinge == pytest.approx([-1.15, -1.0], abs=1e-5)
    assert leaf.tip == pytest.approx([-1.15, -0.1], abs=1e-5)
    assert leaf.arc()[0] == pytest.approx([-0.25, -1.0], abs=1e-5)


def test_doors_that_no_wall_explains_are_furniture(room: Scene) -> None:
    boxes = room.objects.boxes
    centre = boxes.centre.clone()
    centre[0] = torch.tensor([0.0, 1.0, 1.0])  # in the middle of the room
    yaw = boxes.yaw.clone()
    yaw[1] = 0.8  # across its wall
    objects = replace(room.objects, boxes=replace(boxes, centre=centre, yaw=yaw))
    plan = floor_plan(replace(room, objects=objects))
    assert plan.openings == ()
    assert {p.category for p in plan.furniture} == {"door", "window", "bed", "floor_lamp"}


def test_wide_doors_have_two_leaves(room: Scene) -> None:
    size = room.objects.boxes.size.clone()
    size[0, 0] = 1.6
    boxes = replace(room.objects.boxes, size=size)
    plan = floor_plan(replace(room, objects=replace(room.objects, boxes=boxes)))
    assert len(plan.openings[0].leaves) == 2


@pytest.mark.parametrize("seed", [1, 2, 4])
def test_labels_are_legible(seed: int) -> None:
    plan = floor_plan(sample_room(np.random.default_rng(seed), objects=25))
    labels = [label for label in plan.labels if label.number is None]
    assert len(labels) >= 6
    assert len(plan.labels) == len(plan.furniture)
    for k, label in enumerate(labels):
        piece = plan.furniture[label.piece]
        assert piece.shape.buffer(1e-6).covers(label.shape)
        assert label.size >= plan.metres(2.0)
        for other in labels[:k]:
            assert label.shape.intersection(other.shape).area < 1e-9
    numbers = {label.number for label in plan.labels if label.number is not None}
    assert numbers == set(range(1, len(plan.key) + 1))


def test_svg_is_valid_and_complete(room: Scene, tmp_path: Path) -> None:
    named = replace(room, name="Küche & <Bad>")
    write_floor_plan_svg(named, tmp_path / "plan.svg")
    text = (tmp_path / "plan.svg").read_text(encoding="utf-8")
    root = ET.fromstring(text)  # noqa: S314
    assert root.tag == f"{SVG}svg"
    left, top, width, height = map(float, root.attrib["viewBox"].split())
    assert (left, top) == (0, 0)
    assert root.attrib["width"] == f"{width:.2f}mm"
    assert root.findtext(f"{SVG}title") == "Floor plan of Küche & <Bad>"
    # nothing is fetched: no links, no addresses but the namespace
    assert re.findall(r"(?:href|url\(|src|@import|https?://)", text) == ["http://"]
    titles = [title.text for title in root.iter(f"{SVG}title")]
    assert "bed <1> & co: bed" in titles
    assert "door: door, 0.90 m" in titles
    written = [element.text for element in root.iter(f"{SVG}text")]
    assert {"bed", "20.0 m²", "5.00", "4.00", "0.90", "1.20", "Küche & <Bad>"} <= set(written)
    # the places of the floor on paper lead back to metres
    (floor,) = [e for e in root.iter(f"{SVG}polygon") if e.attrib.get("class") == "floor"]
    places = np.array([p.split(",") for p in floor.attrib["points"].split()], dtype=float)
    unit = float(root.attrib["data-metres-per-unit"])
    x = float(root.attrib["data-left"]) + unit * places[:, 0]
    y = float(root.attrib["data-top"]) - unit * places[:, 1]
    assert np.stack([x, y], 1) == pytest.approx(floor_plan(room).corners, abs=0.01)
    assert (places >= 0).all()
    assert (places <= [width, height]).all()


def test_dxf_passes_the_audit(sample: Scene, room: Scene, tmp_path: Path) -> None:
    for scene in (sample, room):
        write_floor_plan_dxf(scene, tmp_path / "plan.dxf")
        drawing = readfile(tmp_path / "plan.dxf")
        auditor = drawing.audit()
        assert auditor.errors == []
        assert auditor.fixes == []
        assert drawing.header["$INSUNITS"] == 6  # metres
        plan = floor_plan(scene)
        space = drawing.modelspace()
        measured = sorted(e.get_measurement() for e in space if isinstance(e, Dimension))
        assert measured == pytest.approx(sorted(d.length for d in plan.dimensions), abs=1e-5)
        inserts = [entity for entity in space if isinstance(entity, Insert)]
        assert len(inserts) == len(plan.furniture)
        names = {insert.get_xdata("PANOSCENE")[0].value for insert in inserts}
        assert names == {piece.name for piece in plan.furniture}
        assert len(space.query("ARC")) == sum(len(o.leaves) for o in plan.openings)
        layers = {entity.dxf.layer for entity in space}
        assert {"WALLS", "DOORS", "WINDOWS", "FURNITURE", "DIMENSIONS", "TEXT"} <= layers
        assert all(layer in drawing.layers for layer in layers)
        lines = [e for e in space if isinstance(e, LWPolyline) and e.dxf.layer == "WALLS"]
        outline = shapely.unary_union([shapely.Polygon(e.get_points("xy")) for e in lines])
        assert outline.symmetric_difference(plan.walls).area < 1e-3


def test_furniture_blocks_stand_where_the_boxes_are(room: Scene, tmp_path: Path) -> None:
    write_floor_plan_dxf(room, tmp_path / "plan.dxf")
    drawing = readfile(tmp_path / "plan.dxf")
    pieces = {piece.name: piece for piece in floor_plan(room).furniture}
    inserts = [entity for entity in drawing.modelspace() if isinstance(entity, Insert)]
    assert len(inserts) == 2
    for insert in inserts:
        piece = pieces[insert.get_xdata("PANOSCENE")[0].value]
        outline = next(e for e in insert.virtual_entities() if isinstance(e, LWPolyline))
        assert shapely.Polygon(outline.get_points("xy")).symmetric_difference(
            piece.shape
        ).area == pytest.approx(0, abs=1e-6)


def test_rooms_of_any_shape_and_size(room: Scene, empty: Scene, tmp_path: Path) -> None:
    angle = np.linspace(0, 2 * np.pi, 7, endpoint=False)
    heptagon = torch.tensor(np.stack([np.cos(angle), np.sin(angle)], 1)).float() * 3
    nook = torch.tensor(
        [[0.0, 0], [6, 0], [6, 4], [2, 4], [2, 3], [5, 3], [5, 1], [1, 1], [1, 5], [0, 5]]
    )
    for k, polygon in enumerate([heptagon, nook, heptagon * 400, heptagon * 0.02]):
        scene = replace(room if k < 2 else empty, layout=Layout(polygon), relations=None)
        plan = floor_plan(scene)
        walls = {d.wall for d in plan.dimensions if d.wall is not None}
        assert walls == set(range(len(polygon)))
        write_floor_plan_svg(scene, tmp_path / "plan.svg")
        write_floor_plan_dxf(scene, tmp_path / "plan.dxf")
        root = ET.parse(tmp_path / "plan.svg").getroot()  # noqa: S314
        assert max(map(float, root.attrib["viewBox"].split())) < 420


@pytest.mark.parametrize(("wide", "lengths"), [(0.5, 1), (0.3, 1), (3.0, 2)])
def test_a_narrow_nook_has_one_dimension_of_its_depth(
    empty: Scene, wide: float, lengths: int
) -> None:
    nook = [[0.0, 0], [2, 0], [2, 0.6], [2 + wide, 0.6], [2 + wide, 0], [6, 0], [6, 4], [0, 4]]
    layout = Layout(torch.tensor(nook))
    plan = floor_plan(replace(empty, layout=layout, relations=None))
    depths = [d for d in plan.dimensions if d.text == "0.60"]
    assert len(depths) == lengths
    for one in depths:  # beside its wall, in the nook
        assert 2.1 < one.line[0, 0] < 2 + wide - 0.1


def test_bad_scenes_leave_nothing(room: Scene, tmp_path: Path) -> None:
    boxes = replace(room.objects.boxes, size=torch.full((4, 3), torch.nan))
    bad = replace(room, objects=replace(room.objects, boxes=boxes))
    for write in (write_floor_plan_svg, write_floor_plan_dxf):
        with pytest.raises(SceneFormatError, match="size"):
            write(bad, tmp_path / "plan")
    assert list(tmp_path.iterdir()) == []
