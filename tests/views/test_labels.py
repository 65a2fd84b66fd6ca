"""Every object has one label, and labels do not overlap."""

import itertools

import numpy as np
import pytest
import shapely

from panoscene.scene import Scene
from panoscene.synth import perturb_scene, sample_room
from panoscene.views._birds_eye import _place_labels
from panoscene.views._key import key_rows, number_ranges
from panoscene.views._labels import Label, place_names
from panoscene.views._page import Page
from panoscene.views._panels import Panel, make_panels, number_objects


def placed(scene: Scene) -> tuple[Page, Panel, dict[int, Label], dict[int, str]]:
    page = Page(1200, 900)
    panels = make_panels([("", scene)], None, True, (1200, 900))
    names = [place_names(panels[0].plan, page.label_size)]
    numbers = number_objects(panels, names)
    return page, panels[0], _place_labels(page, panels[0], names[0], numbers[0], []), numbers[0]


def rectangle(page: Page, label: Label) -> shapely.Polygon:
    width, height = page.label_size(label.text)
    if label.rotation:
        width, height = height, width
    x, y = label.x, label.y
    return shapely.box(x - width / 2, y - height / 2, x + width / 2, y + height / 2)


@pytest.mark.parametrize(
    ("seed", "objects", "disturbed"),
    [(0, 16, False), (1, 64, True), (2, 25, True), (3, 5, False)],
)
def test_labels_do_not_overlap(seed: int, objects: int, disturbed: bool) -> None:
    scene = sample_room(np.random.default_rng(seed), objects=objects)
    if disturbed:
        scene = perturb_scene(scene, np.random.default_rng(seed))
    page, panel, labels, numbers = placed(scene)
    assert set(labels) == set(range(objects)), "one label for each object"
    assert len(set(numbers.values())) == len(numbers), "each number once"
    rectangles = [rectangle(page, label) for label in labels.values()]
    overlaps = [a.intersection(b).area for a, b in itertools.combinations(rectangles, 2)]
    assert max(overlaps, default=0.0) == 0.0
    sheet = shapely.box(panel.left, 0, panel.right, page.height)
    assert all(sheet.contains(shape) for shape in rectangles)


def test_names_lie_inside_their_objects() -> None:
    page, panel, labels, numbers = placed(sample_room(np.random.default_rng(4), objects=20))
    named = [piece for piece in panel.plan.pieces if piece.index not in numbers]
    assert named
    for piece in named:
        assert piece.footprint.buffer(1.0).contains(rectangle(page, labels[piece.index]))


def test_an_object_has_the_same_number_in_every_panel() -> None:
    scene = sample_room(np.random.default_rng(5), objects=15)
    disturbed = perturb_scene(scene, np.random.default_rng(0))
    page = Page(1600, 800)
    panels = make_panels([("", disturbed), ("", scene)], None, True, (1600, 800))
    names = [place_names(panel.plan, page.label_size) for panel in panels]
    before, after = number_objects(panels, names)
    assert before == after
    assert before


def test_the_key_explains_every_number_and_only_the_marks_that_are_there() -> None:
    _, panel, _, numbers = placed(sample_room(np.random.default_rng(1), objects=40))
    rows = key_rows([panel.plan], [numbers], with_reference=False)
    listed = [
        number
        for row in rows
        if row.kind == "number"
        for part in row.number.split(", ")
        for number in range(int(part.split("-")[0]), int(part.split("-")[-1]) + 1)
    ]
    assert sorted(listed) == sorted(map(int, numbers.values()))
    assert {row.text for row in rows if row.kind == "mark"} >= {"front", "contact", "camera"}
    assert not {row.text for row in rows} & {"collision", "outside", "both", "reference"}


def test_ranges_of_numbers() -> None:
    assert number_ranges(set()) == ""
    assert number_ranges({7}) == "7"
    assert number_ranges({1, 2, 5, 6, 7, 9}) == "1-2, 5-7, 9"
