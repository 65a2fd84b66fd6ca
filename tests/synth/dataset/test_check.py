"""Every check passes good panoramas and catches one that is broken on purpose."""

import json
import shutil
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from panoscene.scene import Scene
from panoscene.synth.dataset import (
    CHECKS,
    SET_CHECKS,
    DatasetError,
    check_dataset,
    finish_index,
    label_panorama,
    open_dataset,
    read_index,
)
from panoscene.synth.dataset._loaded import Loaded
from panoscene.synth.dataset._point_checks import _largest_gap, check_points
from panoscene.synth.render import PlacedModel

from .conftest import CAMERA, box_home, pose


@pytest.fixture(scope="module", params=["taken", "tilted"])
def good(request, library) -> Loaded:
    taken = request.getfixturevalue(request.param)
    panorama = label_panorama(taken.scene, taken.rendered)
    rendered = panorama.rendered
    return Loaded(
        "good", panorama.scene, panorama.labels, rendered.rgb,
        np.rint(rendered.distance.astype(np.float64) * 1000) / 1000, rendered.instance,
        panorama.semantic.astype(np.int32), library,
    )  # fmt: skip


def with_box(panorama: Loaded, name: str, **changes: object) -> Loaded:
    """Return the panorama with another box of an object in labels.json."""
    objects = tuple(
        label.model_copy(update={"box": label.box.model_copy(update=changes)})
        if label.id == name
        else label
        for label in panorama.labels.objects
    )
    return replace(panorama, labels=panorama.labels.model_copy(update={"objects": objects}))


def box_of(panorama: Loaded, name: str):
    return next(label.box for label in panorama.labels.objects if label.id == name)


def moved_box(panorama: Loaded) -> Loaded:
    x, y, z = box_of(panorama, "table-2").centre
    return with_box(panorama, "table-2", centre=(x + 0.2, y, z))


def larger_box(panorama: Loaded) -> Loaded:
    wide, deep, high = box_of(panorama, "picture-6").size
    return with_box(panorama, "picture-6", size=(wide, deep + 0.4, high))


def turned_layout(panorama: Loaded) -> Loaded:
    layout = panorama.scene.layout
    turn = torch.tensor([[0.999, -0.0447], [0.0447, 0.999]])
    polygon = layout.floor_polygon @ turn.T
    return replace(
        panorama, scene=replace(panorama.scene, layout=replace(layout, floor_polygon=polygon))
    )


def other_scale(panorama: Loaded) -> Loaded:
    return replace(panorama, distance=panorama.distance * 1.01)


def hole(panorama: Loaded) -> Loaded:
    instance = panorama.instance.copy()
    instance[200:260, 100:160] = 0
    return replace(panorama, instance=instance)


def unlisted(panorama: Loaded) -> Loaded:
    instance = panorama.instance.copy()
    instance[0, :20] = 4444
    return replace(panorama, instance=instance)


def other_semantics(panorama: Loaded) -> Loaded:
    return replace(panorama, semantic=np.where(panorama.semantic == 36, 2, panorama.semantic + 0)
                   if (panorama.semantic == 36).any() else panorama.semantic + 1)  # fmt: skip


def other_relation(panorama: Loaded) -> Loaded:
    relations = panorama.scene.relations
    assert relations is not None
    touching = relations.touching.clone()
    touching[0, 1] = 1 - touching[0, 1]
    return replace(
        panorama,
        scene=replace(panorama.scene, relations=replace(relations, touching=touching)),
    )


def other_mesh(panorama: Loaded) -> Loaded:
    assert panorama.library is not None
    sofa = panorama.library["test/sofa"]
    larger = replace(sofa, vertices=sofa.vertices * np.float32(1.1))
    return replace(panorama, library=dict(panorama.library) | {"test/sofa": larger})


def mirrored_labels(panorama: Loaded) -> Loaded:
    return replace(
        panorama,
        instance=panorama.instance[:, ::-1],
        distance=panorama.distance[:, ::-1],
        semantic=panorama.semantic[:, ::-1],
    )


def mirrored_picture(panorama: Loaded) -> Loaded:
    return replace(panorama, rgb=panorama.rgb[:, ::-1])


def shifted_picture(panorama: Loaded) -> Loaded:
    return replace(panorama, rgb=np.roll(panorama.rgb, 8, axis=1))


def brighter_left(panorama: Loaded) -> Loaded:
    ramp = np.linspace(60, 0, panorama.rgb.shape[1])[:, None]
    return replace(panorama, rgb=np.clip(panorama.rgb + ramp, 0, 255).astype(np.uint8))


def torn_distance(panorama: Loaded) -> Loaded:
    """Stretch the columns more and more, so that only the seam is torn."""
    stretch = np.linspace(1.0, 1.05, panorama.distance.shape[1])
    return replace(panorama, distance=panorama.distance * stretch)


def torn_instances(panorama: Loaded) -> Loaded:
    """Slide the columns down more and more, so that only the seam is torn."""
    height, width = panorama.instance.shape
    rows = np.arange(height)[:, None] + np.linspace(0, height / 2, width).astype(int)
    return replace(panorama, instance=panorama.instance[rows % height, np.arange(width)])


def black(panorama: Loaded) -> Loaded:
    return replace(panorama, rgb=panorama.rgb // 40)


def blown(panorama: Loaded) -> Loaded:
    rgb = panorama.rgb.copy()
    rgb[100:350] = 255
    return replace(panorama, rgb=rgb)


def half_black(panorama: Loaded) -> Loaded:
    rgb = panorama.rgb.copy()
    rgb[:, :400] = 2
    return replace(panorama, rgb=rgb)


def grey(panorama: Loaded) -> Loaded:
    return replace(panorama, rgb=np.full_like(panorama.rgb, 120))


BREAKS: list[tuple[str, Callable[[Loaded], Loaded]]] = [
    ("distance", turned_layout),
    ("distance", other_scale),
    ("holes", hole),
    ("masks", moved_box),
    ("masks", unlisted),
    ("masks", other_semantics),
    ("points", larger_box),
    ("points", moved_box),
    ("points", other_scale),
    ("relations", other_relation),
    ("relations", moved_box),
    ("relations", other_mesh),
    ("mirrored", mirrored_labels),
    ("alignment", mirrored_picture),
    ("alignment", shifted_picture),
    ("seam", brighter_left),
    ("seam", torn_distance),
    ("seam", torn_instances),
    ("exposure", black),
    ("exposure", blown),
    ("exposure", half_black),
    ("exposure", grey),
]


def test_a_good_panorama_passes(good: Loaded):
    assert {name: check(good) for name, check in CHECKS.items()} == {name: [] for name in CHECKS}


@pytest.mark.parametrize(("check", "broken"), BREAKS, ids=[f"{c}-{b.__name__}" for c, b in BREAKS])  # ty: ignore[missing-attribute]
def test_a_broken_panorama_is_caught(good: Loaded, check: str, broken):
    assert CHECKS[check](broken(good))


def test_every_check_has_something_that_breaks_it():
    assert {check for check, _ in BREAKS} == set(CHECKS)


def test_coarse_pictures_may_end_farther_from_a_face():
    """Two pixels of 6 mm at 1 m and 1024 columns, of 25 mm at 256."""
    eye, half = np.array([0.0, -3.0, 0.0]), np.full(3, 0.1)
    points = np.array([[0.0, -0.04, 0.0], [0.0, 0.04, 0.0]])
    distance = np.full(2, 1.0)
    assert _largest_gap(points, eye, half, distance, 1024) == pytest.approx(0.06, abs=1e-9)
    assert _largest_gap(points, eye, half, distance, 256) is None


@pytest.fixture(scope="module")
def edge_on(request, photograph, library) -> Loaded:
    """A hood whose pane is at the height of the camera, and falls between the pixels."""
    pitch, roll = request.param
    camera = replace(CAMERA, pitch=pitch, roll=roll, width=640, height=320)
    scene = replace(
        box_home(), placed=(PlacedModel(library["test/range_hood"], pose(2, 3.8, 1.948, np.pi), 1),)
    )
    panorama = label_panorama(scene, photograph(scene, camera))
    rendered = panorama.rendered
    return Loaded(
        "edge on", panorama.scene, panorama.labels, rendered.rgb,
        rendered.distance.astype(np.float64), rendered.instance, panorama.semantic.astype(np.int32),
        library,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("edge_on", "with_meshes"),
    [((0.0, 0.0), True), ((0.0, 0.0), False), ((-0.08, 0.06), True)],
    indirect=["edge_on"],
)
def test_thin_parts_seen_edge_on_are_let_pass_but_no_larger_boxes(edge_on, with_meshes: bool):
    panorama = edge_on if with_meshes else replace(edge_on, library=None)
    names = [label.category for label in panorama.labels.objects]
    k = names.index("range_hood")
    hood, found = panorama.labels.objects[k], panorama.object_pixels
    mine = slice(found.start[k], found.start[k + 1])
    points = found.eye[k] + found.ray[mine] * found.distance[mine, None]
    assert _largest_gap(points, found.eye[k], found.half[k], found.distance[mine], 640) is not None
    assert check_points(panorama) == []
    wide, deep, high = hood.box.size
    (problem,) = check_points(with_box(panorama, hood.id, size=(wide, deep + 0.3, high)))
    assert "before a face" in problem


def test_scenes_without_relations_are_caught(good: Loaded):
    bare: Scene = replace(good.scene, relations=None)
    assert CHECKS["relations"](replace(good, scene=bare))


def test_a_good_set_passes(small_set: Path, library):
    calls: list[tuple[int, int]] = []
    found = check_dataset(
        small_set, library=library, progress=lambda done, total: calls.append((done, total))
    )
    assert found["problems"] == []
    assert found["failures"] == 0
    assert found["panoramas"] == 4
    assert set(found) == {"panoramas", "failures", "problems", *CHECKS, *SET_CHECKS}
    assert calls[-1] == (4, 4)
    json.dumps(found)


@pytest.fixture
def copied(small_set: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(small_set, tmp_path / "set"))


def broken_by(root: Path, names: list[str] | None = None) -> set[str]:
    found = check_dataset(root, names=names)
    return {name for name in (*CHECKS, *SET_CHECKS) if found[name]}


def test_another_file_is_caught_by_its_hash(copied: Path):
    item = open_dataset(copied)[0]
    picture = Image.open(item.folder / "rgb.jpg")
    picture.save(item.folder / "rgb.jpg", quality=60)
    assert broken_by(copied, [item.name]) == {"hashes"}


def test_another_pixel_is_caught_by_the_label_hash(copied: Path):
    item = open_dataset(copied)[0]
    path = item.folder / "distance.png"
    distance = np.array(Image.open(path))
    distance[0, 0] += 1
    Image.fromarray(distance).save(path)
    assert "hashes" in broken_by(copied, [item.name])


def test_missing_and_damaged_files_are_caught(copied: Path):
    item = open_dataset(copied)[0]
    (item.folder / "semantic.png").unlink()
    assert broken_by(copied, [item.name]) == {"files"}
    Image.new("L", (20, 10)).save(item.folder / "semantic.png")
    assert broken_by(copied, [item.name]) == {"files"}
    huge = bytearray((item.folder / "distance.png").read_bytes())
    huge[16:24] = (100_000).to_bytes(4, "big") * 2  # width and height: ten thousand million pixels
    huge[29:33] = zlib.crc32(huge[12:29]).to_bytes(4, "big")
    (item.folder / "semantic.png").write_bytes(huge)
    assert broken_by(copied, [item.name]) == {"files"}
    short = bytearray(huge)
    short[8:12] = (5).to_bytes(4, "big")  # a header that ends early
    (item.folder / "semantic.png").write_bytes(short)
    assert broken_by(copied, [item.name]) == {"files"}
    (item.folder / "scene.json").write_text("{")
    assert broken_by(copied, [item.name]) == {"files"}


def test_a_home_in_two_parts_is_caught(copied: Path):
    path = copied / "dataset.json"
    text = path.read_text()
    home = read_index(copied).panoramas[0].home
    name = f"{home}-0"
    other = text.replace(f'"home": "{home}", "split": "train"', f'"home": "{home}", "split": "val"')
    assert other != text
    path.write_text(other)
    assert "splits" in broken_by(copied, [name])


def test_an_unseen_model_in_training_is_caught(copied: Path):
    path = copied / "dataset.json"
    text = path.read_text()
    path.write_text(text.replace('"unseen_bases": []', '"unseen_bases": ["test/sofa"]'))
    assert path.read_text() != text
    found = check_dataset(copied)
    assert found["splits"] == 3  # all but test-unseen


def test_twins_are_caught(copied: Path):
    names = [item.name for item in open_dataset(copied)]
    one, two = (copied / "panoramas" / name for name in names[:2])
    shutil.rmtree(two)
    shutil.copytree(one, two)
    finish_index(copied)
    assert "distinct" in broken_by(copied, [names[2]])


def test_panoramas_that_are_not_in_the_index_are_caught(copied: Path):
    item = open_dataset(copied)[0]
    shutil.copytree(item.folder, item.folder.with_name("stray-0"))
    assert broken_by(copied, [item.name]) == {"files"}


def test_unknown_names_are_refused(small_set: Path, tmp_path: Path):
    with pytest.raises(ValueError, match="home9999"):
        check_dataset(small_set, names=["home9999-0"])
    with pytest.raises(DatasetError):
        check_dataset(tmp_path)
