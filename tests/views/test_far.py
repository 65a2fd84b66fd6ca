"""Objects outside the picture are pointed at; numbers are those of the scene."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
import torch
from PIL import Image

from panoscene.scene import Scene
from panoscene.synth import sample_room
from panoscene.views import draw_birds_eye
from panoscene.views._far import Pointer, place_pointers
from panoscene.views._labels import place_names
from panoscene.views._page import Page
from panoscene.views._panels import Panel, make_panels, number_objects


def moved(scene: Scene, shifts: dict[int, tuple[float, float]]) -> Scene:
    boxes = scene.objects.boxes
    centre = boxes.centre.clone()
    for index, shift in shifts.items():
        centre[index, :2] += torch.tensor(shift)
    return replace(scene, objects=replace(scene.objects, boxes=replace(boxes, centre=centre)))


def pointers(scene: Scene) -> tuple[Page, Panel, list[Pointer]]:
    page = Page(1200, 900)
    (panel,) = make_panels([("", scene)], None, True, (1200, 900))
    placed = place_pointers(
        panel.plan,
        panel.far,
        panel.content,
        numbers={},
        scale=panel.view.scale,
        measure=page.label_size,
    )
    return page, panel, placed


def test_nothing_points_where_all_is_shown() -> None:
    _, panel, placed = pointers(sample_room(np.random.default_rng(0), objects=10))
    assert panel.far == frozenset()
    assert placed == []


@pytest.mark.parametrize("away", [(40.0, 0.0), (-40.0, 0.0), (0.0, 40.0), (3.0, -40.0)])
def test_an_object_far_away_is_pointed_at(away: tuple[float, float]) -> None:
    scene = sample_room(np.random.default_rng(1), objects=6)
    _, panel, (pointer,) = pointers(moved(scene, {2: away}))
    assert panel.far == {2}
    assert 2 not in {piece.index for piece in panel.near.pieces}
    name, distance = pointer.text.split(", ")
    piece = next(piece for piece in panel.plan.pieces if piece.index == 2)
    assert name == piece.category.replace("_", " ")
    assert 20 < float(distance.removesuffix(" m")) < 60
    towards = np.array(piece.footprint.centroid.coords[0]) - np.array(pointer.arrow)
    assert np.dot(towards / np.linalg.norm(towards), pointer.direction) > 0.95
    assert not shapely.box(*panel.content).contains(shapely.Point(pointer.arrow))


@pytest.mark.parametrize("count", [3, 12, 60])
def test_pointers_do_not_overlap_and_count_all(count: int) -> None:
    scene = sample_room(np.random.default_rng(2), objects=count)
    places = np.random.default_rng(0).uniform(-80, 80, (count, 2))
    far = moved(scene, {k: (float(x), float(y)) for k, (x, y) in enumerate(places)})
    page, panel, placed = pointers(far)
    strips = [pointer.strip for pointer in placed]
    assert all(a.intersection(b).area < 1e-6 for a, b in itertools.combinations(strips, 2))
    sheet = shapely.box(panel.left, 0, panel.right, page.height)
    assert all(sheet.contains(strip) for strip in strips)
    shared = sum(int(p.text.removeprefix("+")) for p in placed if p.group is None)
    assert sum(p.group is not None for p in placed) + shared == len(panel.far)


def test_lines_to_objects_out_of_sight_are_left_out() -> None:
    scene = sample_room(np.random.default_rng(3), objects=12)
    assert scene.relations is not None
    touching = int((scene.relations.touching_wall.amax(1) >= 0.5).nonzero()[0])
    far = moved(scene, {touching: (300.0, 200.0)})
    _, panel, _ = pointers(far)
    assert all(touching not in contact.objects for contact in panel.plan.contacts)


def test_touching_objects_a_kilometre_apart_are_drawn(tmp_path: Path) -> None:
    scene = sample_room(np.random.default_rng(4), objects=4)
    assert scene.relations is not None
    together = torch.ones(4, 4) - torch.eye(4)
    scene = replace(scene, relations=replace(scene.relations, touching=together))
    draw_birds_eye(moved(scene, {0: (1e3, 70.0), 1: (-30.0, 1e4)}), tmp_path / "far.png")
    with Image.open(tmp_path / "far.png") as picture:
        assert picture.width == 1200


def test_the_number_of_an_object_is_its_place_in_the_scene() -> None:
    scene = sample_room(np.random.default_rng(5), objects=20)
    for size in ((1200, 900), (700, 500)):
        page = Page(*size)
        panels = make_panels([("", scene)], None, True, size)
        (numbers,) = number_objects(panels, [place_names(panels[0].near, page.label_size)])
        assert numbers
        assert all(text == str(index) for index, text in numbers.items())
