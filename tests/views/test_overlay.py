"""Overlays are whole pictures with one label for each object, inside the picture."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from panoscene.geometry import wall_distance
from panoscene.scene import CATEGORIES, Scene
from panoscene.style import ALARM, GROUP_COLOURS, group_of
from panoscene.synth import sample_room
from panoscene.views._curves import overlay_curves
from panoscene.views._overlay import _targets, draw_overlay, label_text, overlay_page
from panoscene.views._overlay_labels import Placed, Target, place_labels
from panoscene.views._page import Page
from panoscene.views._pictures import fitted_pixels, plain_room


def room(seed: int, objects: int, corners: int = 4) -> Scene:
    return sample_room(np.random.default_rng(seed), objects=objects, corners=corners)


def rgb(colour: str) -> np.ndarray:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)])


def count(pixels: np.ndarray, colour: str) -> int:
    return int((np.abs(pixels.astype(int) - rgb(colour)).max(-1) < 16).sum())


@pytest.mark.parametrize(("objects", "corners"), [(0, 4), (1, 10), (12, 8)])
def test_a_scene_becomes_a_panorama(tmp_path: Path, objects: int, corners: int) -> None:
    file = tmp_path / "overlay.png"
    draw_overlay(room(1, objects, corners), file, width_px=512)
    with Image.open(file) as picture:
        assert picture.size == (512, 256)
    assert [path.name for path in tmp_path.iterdir()] == ["overlay.png"]


def test_sizes_follow_the_photo(tmp_path: Path) -> None:
    scene, file = room(2, 2), tmp_path / "overlay.png"
    for width, expected in ((300, 300), (2600, 2048)):
        draw_overlay(scene, file, image=torch.zeros(3, width // 2, width))
        with Image.open(file) as picture:
            assert picture.size == (expected, expected // 2)


def test_the_photo_shows_where_nothing_is_drawn() -> None:
    photo = torch.rand(3, 128, 256, generator=torch.Generator().manual_seed(0))
    scene = room(3, 0)
    pixels = overlay_page(scene, 256, image=photo).pixels()
    same = (pixels == fitted_pixels(photo, 256, 128)).all(-1)
    assert same[:20].all(), "the ceiling above the layout is the photo, pixel for pixel"
    assert 0.6 < same.mean() < 0.99


def test_objects_wear_the_colour_of_their_group() -> None:
    scene = room(4, 6)
    pixels = overlay_page(scene, 512, labels=False).pixels()
    bare = overlay_page(room(4, 0), 512, labels=False).pixels()
    groups = {group_of(CATEGORIES[int(k)]) for k in scene.objects.category}
    for group in groups - {"doors and windows"}:
        assert count(pixels, GROUP_COLOURS[group]) > count(bare, GROUP_COLOURS[group]) + 20


def test_only_collisions_are_red() -> None:
    scene = room(3, 7)
    assert count(overlay_page(scene, 512).pixels(), ALARM) == 0
    boxes = scene.objects.boxes
    centre = boxes.centre.clone()
    centre[0] = centre[1]
    wrong = replace(scene, objects=replace(scene.objects, boxes=replace(boxes, centre=centre)))
    assert count(overlay_page(wrong, 512).pixels(), ALARM) > 20
    # a cushion may well be in the box of its sofa
    category = scene.objects.category.clone()
    category[:2] = torch.tensor([CATEGORIES.index(name) for name in ("cushion", "sofa")])
    at_home = replace(wrong, objects=replace(wrong.objects, category=category))
    assert count(overlay_page(at_home, 512).pixels(), ALARM) == 0


def test_a_reference_is_drawn() -> None:
    scene, truth = room(5, 3), room(6, 3)
    plain = overlay_page(scene, 512, labels=False).pixels()
    assert (overlay_page(scene, 512, labels=False, reference=truth).pixels() != plain).any()


@pytest.mark.parametrize("width", [0, 33, 63, 1023, 20000])
def test_bad_widths_leave_nothing_behind(tmp_path: Path, width: int) -> None:
    with pytest.raises(ValueError, match="width_px"):
        draw_overlay(room(1, 1), tmp_path / "overlay.png", width_px=width)
    assert not list(tmp_path.iterdir())


def test_labels_say_category_score_and_collision() -> None:
    scene = room(7, 2)
    name = label_text(scene, 0, False)
    assert name == CATEGORIES[int(scene.objects.category[0])].replace("_", " ")
    unsure = replace(scene, objects=replace(scene.objects, score=torch.tensor([0.874, 1.0])))
    assert label_text(unsure, 0, False) == f"{name} 0.87"
    assert label_text(unsure, 0, True) == f"⚠ {name} 0.87"


def rectangle(label: Placed, target: Target) -> np.ndarray:
    half = np.array(target.size) / 2
    middle = np.array([label.u, label.v])
    return np.concatenate([middle - half, middle + half])


@pytest.mark.parametrize(("seed", "objects", "width"), [(0, 20, 1024), (1, 40, 1536), (2, 1, 256)])
def test_each_object_has_one_label_inside_the_picture(seed: int, objects: int, width: int) -> None:
    scene = room(seed, objects)
    texts = [label_text(scene, k, False) for k in range(objects)]
    page = Page(width, width // 2)
    targets = _targets(page, overlay_curves(scene), texts, 12.0)
    labels = place_labels(targets, width, width // 2)
    assert sorted(label.index for label in labels) == list(range(objects))
    by_index = {target.index: target for target in targets}
    boxes = np.array([rectangle(label, by_index[label.index]) for label in labels])
    assert (boxes[:, :2] >= 0).all()
    assert (boxes[:, 2] <= width).all()
    assert (boxes[:, 3] <= width // 2).all()
    low = np.maximum(boxes[:, None, :2], boxes[None, :, :2])
    high = np.minimum(boxes[:, None, 2:], boxes[None, :, 2:])
    shared = np.maximum(high - low, 0).prod(-1)
    np.fill_diagonal(shared, 0)
    # in a crowd a few corners may meet
    assert (shared > 0.1 * (boxes[0, 2:] - boxes[0, :2]).prod()).sum() <= 2


def test_a_label_at_the_seam_stays_on_one_side() -> None:
    target = Target(0, np.array([980.0, 200.0, 1060.0, 300.0]), (60.0, 16.0))
    (label,) = place_labels([target], 1024, 512)
    assert 30 <= label.u <= 994
    assert min(abs(label.u - side) for side in (994, 30)) < 60
    assert label.leader is None


def test_a_label_away_from_its_object_has_a_leader() -> None:
    near = [Target(k, np.array([500.0, 250.0, 506.0, 256.0]), (90.0, 16.0)) for k in range(8)]
    labels = place_labels(near, 1024, 512)
    assert any(label.leader is not None for label in labels)
    assert len({(label.u, label.v) for label in labels}) == 8


def test_the_plain_room_agrees_with_the_layout() -> None:
    scene = room(8, 0, 6)
    pixels = plain_room(scene.layout, 1.6, 512, 256)
    lon = 2 * np.pi * ((np.arange(512) + 0.5) / 512 - 0.5)
    distance = wall_distance(scene.layout.floor_polygon.double(), torch.as_tensor(lon)).numpy()
    rows = (0.5 + np.arctan2(1.6, distance) / np.pi) * 256
    for column in range(0, 512, 37):
        edge = int(rows[column])
        assert (pixels[edge + 1, column] != pixels[edge - 1, column]).any()
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) == 3


def test_pictures_are_resized_and_empty_ones_refused() -> None:
    white = fitted_pixels(torch.full((3, 4, 8), 7.0), 16, 8)
    assert white.shape == (8, 16, 3)
    assert (white == 255).all()
    with pytest.raises(ValueError, match="image"):
        fitted_pixels(torch.zeros(3, 0, 8), 16, 8)
