"""Pictures exist, are whole, show what they should, and fail without leaving pieces behind."""

import threading
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
import torch
from PIL import Image

from panoscene.geometry import OrientedBoxes
from panoscene.scene import Objects, Scene, category_index, objects_from_boxes, scene_from_boxes
from panoscene.style import ALARM
from panoscene.synth import PerturbNoise, perturb_scene, sample_room
from panoscene.views import draw_birds_eye, draw_comparison
from panoscene.views._pieces import _wall_contact

SMALL = (620, 420)


def room(seed: int, objects: int, corners: int = 4) -> Scene:
    return sample_room(np.random.default_rng(seed), objects=objects, corners=corners)


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        assert image.format == "PNG"
        return np.asarray(image.convert("RGB")).astype(int)


def red(path: Path, width: int) -> int:
    """Count the pixels of a plan, left of the key, that have the colour of collisions."""
    alarm = [int(ALARM[k : k + 2], 16) for k in (1, 3, 5)]
    return int((np.abs(pixels(path)[:, :width] - alarm).max(-1) < 12).sum())


@pytest.mark.parametrize(
    ("objects", "corners"), [(0, 8), (1, 4), pytest.param(64, 10, id="cluttered")]
)
def test_a_room_becomes_a_picture(tmp_path: Path, objects: int, corners: int) -> None:
    file = tmp_path / "room.png"
    draw_birds_eye(room(1, objects, corners), file, title="Room $1$")
    image = pixels(file)
    assert image.shape[1] == 1200
    assert 560 <= image.shape[0] <= 1000
    plan = image[80:-60, :940]
    assert 0.05 < (plan < 250).any(-1).mean() < 0.95
    assert [path.name for path in tmp_path.iterdir()] == ["room.png"]


def test_pictures_have_the_size_asked_for_and_are_reproducible(tmp_path: Path) -> None:
    scene = room(2, 3)
    for name in ("a.png", "b.png"):
        draw_birds_eye(scene, tmp_path / name, size_px=SMALL)
    assert pixels(tmp_path / "a.png").shape == (420, 620, 3)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    draw_comparison([("A", scene), ("B", scene)], tmp_path / "two.png", size_px=(900, 400))
    assert pixels(tmp_path / "two.png").shape == (400, 900, 3)


def test_a_sound_room_has_no_red_and_a_disturbed_one_has(tmp_path: Path) -> None:
    scene = room(3, 7)
    draw_birds_eye(scene, tmp_path / "sound.png", size_px=SMALL)
    disturbed = perturb_scene(scene, np.random.default_rng(0), PerturbNoise(distance=0.3))
    draw_birds_eye(disturbed, tmp_path / "disturbed.png", size_px=SMALL)
    assert red(tmp_path / "sound.png", 360) == 0
    assert red(tmp_path / "disturbed.png", 360) > 200
    # all is forgiven
    draw_birds_eye(disturbed, tmp_path / "forgiven.png", size_px=SMALL, tolerance=9.0)
    assert red(tmp_path / "forgiven.png", 360) == 0


def test_collisions_count_in_space_not_in_plan(tmp_path: Path) -> None:
    scene = room(4, 1)
    boxes = scene.objects.boxes[[0, 0]]
    tops = boxes.centre.clone()
    tops[0, :2], tops[1, :2] = torch.zeros(2), torch.tensor([0.02, 0.0])
    tops[1, 2] += boxes.size[0, 2]
    above = with_objects(scene, replace_boxes(boxes, tops))
    draw_birds_eye(above, tmp_path / "above.png", size_px=SMALL, relations=False)
    assert red(tmp_path / "above.png", 360) == 0
    tops[1, 2] -= 0.03
    inside = with_objects(scene, replace_boxes(boxes, tops))
    draw_birds_eye(inside, tmp_path / "inside.png", size_px=SMALL, relations=False)
    assert red(tmp_path / "inside.png", 360) > 50


def replace_boxes(boxes, centre):
    return replace(boxes, centre=centre.clone(), size=boxes.size.clamp(max=0.8))


def with_objects(scene: Scene, boxes) -> Scene:
    old = scene.objects
    twice = {
        name: getattr(old, name)[[0, 0]]
        for name in ("category", "score", "bfov", "distance_score", "yaw_score")
    }
    return replace(scene, objects=Objects(boxes=boxes, **twice), relations=None)


def test_relations_and_reference_are_drawn_when_asked_for(tmp_path: Path) -> None:
    scene = room(5, 3)
    files = {}
    kinds: dict[str, dict[str, Any]] = {
        "plain": {"relations": False},
        "relations": {},
        "reference": {"relations": False, "reference": room(6, 2)},
    }
    for name, options in kinds.items():
        files[name] = tmp_path / f"{name}.png"
        draw_birds_eye(scene, files[name], size_px=SMALL, **options)
    plain = pixels(files["plain"])
    for name in ("relations", "reference"):
        assert (pixels(files[name])[:, :360] != plain[:, :360]).any()


def test_relations_are_derived_when_the_scene_has_none(tmp_path: Path) -> None:
    scene = room(5, 3)
    draw_birds_eye(scene, tmp_path / "kept.png", size_px=SMALL)
    draw_birds_eye(replace(scene, relations=None), tmp_path / "derived.png", size_px=SMALL)
    assert (tmp_path / "kept.png").read_bytes() == (tmp_path / "derived.png").read_bytes()


def test_float64_scenes_and_objects_far_away_are_drawn(tmp_path: Path) -> None:
    scene = room(7, 4)
    boxes = scene.objects.boxes
    centre = boxes.centre.double()
    centre[0, 0] += 1000.0
    moved = replace(boxes, centre=centre, size=boxes.size.double(), yaw=boxes.yaw.double())
    far = replace(scene, objects=replace(scene.objects, boxes=moved), relations=None)
    draw_birds_eye(far, tmp_path / "far.png", size_px=SMALL, relations=False)
    plan = pixels(tmp_path / "far.png")[80:-60, :360]
    assert (plan < 250).any(-1).mean() > 0.1, "the room is still large"


@pytest.mark.parametrize("problem", ["nan", "no scenes", "captions", "size", "folder"])
def test_errors_leave_nothing_behind(tmp_path: Path, problem: str) -> None:
    scene = room(8, 2)
    file = tmp_path / "room.png"
    file.write_bytes(b"what was here")
    scenes, captions, size, error = [("", scene)], None, SMALL, ValueError
    if problem == "nan":
        boxes = scene.objects.boxes
        broken = replace(boxes, yaw=boxes.yaw * torch.nan)
        scenes = [("", replace(scene, objects=replace(scene.objects, boxes=broken)))]
    elif problem == "no scenes":
        scenes = []
    elif problem == "captions":
        captions = ["one", "two"]
    elif problem == "size":
        size = (200, 100)
    else:
        file, error = tmp_path / "absent" / "room.png", FileNotFoundError
    with pytest.raises(error):
        draw_comparison(scenes, file, captions=captions, size_px=size)
    assert [path.name for path in tmp_path.iterdir()] == ["room.png"]
    assert (tmp_path / "room.png").read_bytes() == b"what was here"


def test_a_failing_encoder_leaves_the_old_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "room.png"
    file.write_bytes(b"what was here")

    def fail(self: Path, target: Path) -> None:
        raise OSError("disk full")

    monkeypatch.setattr(Path, "replace", fail)
    with pytest.raises(OSError, match="disk full"):
        draw_birds_eye(room(8, 1), file, size_px=SMALL)
    assert [path.name for path in tmp_path.iterdir()] == ["room.png"]
    assert file.read_bytes() == b"what was here"


def test_threads_do_not_disturb_each_other(tmp_path: Path) -> None:
    scenes = [room(seed, 2) for seed in range(2)]
    for k, scene in enumerate(scenes):
        draw_birds_eye(scene, tmp_path / f"alone-{k}.png", size_px=SMALL)
    threads = [
        threading.Thread(
            target=draw_birds_eye,
            args=(scene, tmp_path / f"thread-{k}.png"),
            kwargs={"size_px": SMALL},
        )
        for k, scene in enumerate(scenes)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for k in range(2):
        alone, threaded = tmp_path / f"alone-{k}.png", tmp_path / f"thread-{k}.png"
        assert alone.read_bytes() == threaded.read_bytes()


@pytest.mark.parametrize(
    ("x", "y", "start", "end"),
    [
        # in front of the wall: across it; beside and behind it: from its end to the nearest corner
        (2.0, 2.0, (2.0, -5.0), (2.0, 8.0)),
        (12.0, 0.0, (5.0, 0.0), (16.0, 0.0)),
        (2.0, -3.0, None, (2.0, -6.0)),
    ],
)
def test_contacts_join_the_wall_and_the_object(
    x: float, y: float, start: tuple[float, float] | None, end: tuple[float, float]
) -> None:
    wall = np.array([[0.0, 0.0], [10.0, 0.0]])
    box = shapely.box(x - 1, y - 1, x + 1, y + 1)
    contact = _wall_contact(box, wall[0], wall[1], np.array([0.0, 1.0]))
    if start is not None:
        assert contact.start[1] == pytest.approx(start[1], abs=3)
        assert contact.start[0] == pytest.approx(start[0], abs=1)
    assert shapely.LineString([contact.start, contact.end]).intersects(box)
    assert contact.end[1] == pytest.approx(end[1], abs=4)


def test_doors_and_windows_are_at_home_in_walls(tmp_path: Path) -> None:
    """The same box behind the wall is red as a chest and not as a window."""
    scene = room(2, 1)
    layout = scene.layout
    start, end = layout.floor_polygon[0], layout.floor_polygon[1]
    along = (end - start) / (end - start).norm()
    outward = torch.stack([along[1], -along[0]])
    middle = (start + end) / 2 + 0.1 * outward
    yaw = torch.atan2(along[1], along[0])
    boxes = OrientedBoxes(
        torch.cat([middle, torch.tensor([1.2])])[None], torch.tensor([[0.8, 0.2, 1.0]]), yaw[None]
    )
    for category, marked in (("window", False), ("chest", True)):
        objects = objects_from_boxes(boxes, torch.tensor([category_index(category)]))
        file = tmp_path / f"{category}.png"
        draw_birds_eye(scene_from_boxes(objects, layout), file)
        assert (red(file, 900) > 20) is marked
