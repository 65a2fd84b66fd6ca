import math
from collections.abc import Callable
from pathlib import Path

import pytest
import torch

from panoscene.geometry import OrientedBoxes, bfov_from_boxes
from panoscene.scene import (
    Layout,
    Panorama,
    Scene,
    SceneFormatError,
    objects_from_boxes,
    read_box_table,
    scene_from_boxes,
    write_box_table,
)

HEADER = "category,x,y,z,width,depth,height,yaw"


def write(path: Path, text: str) -> Path:
    path = path / "boxes.csv"
    path.write_text(text)
    return path


def test_a_table_becomes_objects(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        "\ufeffID, Category,yaw_deg,x,y,z,width,depth,height,score\r\n"
        'bed,bed,180,0,1,0.3,1.6,2,0.6,0.75\r\n\r\n"the chair",chair,-90,1,-1,.45,5e-1,.5,.9,1\r\n',
    )
    objects = read_box_table(path, camera_height=1.4)
    assert objects.id == ("bed", "the chair")
    assert objects.category.tolist() == [2, 7]
    torch.testing.assert_close(objects.boxes.yaw, torch.tensor([math.pi, -math.pi / 2]))
    torch.testing.assert_close(objects.boxes.size[1], torch.tensor([0.5, 0.5, 0.9]))
    assert objects.score.tolist() == [0.75, 1.0]
    assert objects.yaw_score.tolist() == [1.0, 1.0]
    torch.testing.assert_close(objects.bfov, bfov_from_boxes(objects.boxes, 1.4))


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_round_trip_of_boxes_is_exact(
    random_scene: Callable[..., Scene], tmp_path: Path, dtype: torch.dtype
) -> None:
    objects = random_scene(2, 7, dtype).objects
    write_box_table(objects, tmp_path / "boxes.csv")
    again = read_box_table(tmp_path / "boxes.csv", dtype=dtype)
    assert again.id == objects.id
    assert torch.equal(again.category, objects.category)
    for name in ("centre", "size", "yaw"):
        assert torch.equal(getattr(again.boxes, name), getattr(objects.boxes, name))
    for name in ("score", "distance_score", "yaw_score"):
        assert torch.equal(getattr(again, name), getattr(objects, name))


def test_a_table_without_boxes(tmp_path: Path) -> None:
    objects = read_box_table(write(tmp_path, HEADER + "\n"))
    assert objects.boxes.centre.shape == (0, 3)
    assert objects.bfov.shape == (0, 4)


GOOD = "bed,0,1,0.3,1.6,2,0.6,0"
BAD_TABLES = [
    ("empty", "", "the file: found nothing in it, expected a header"),
    ("semicolons", HEADER.replace(",", ";"), "line 1: found columns separated by semicolons"),
    ("no yaw", HEADER.removesuffix(",yaw"), "line 1: found 0 yaw columns"),
    ("both yaws", f"{HEADER},yaw_deg", "line 1: found 2 yaw columns"),
    ("missing column", HEADER.replace(",depth", ""), "line 1: found no column 'depth'"),
    ("misspelt", HEADER + ",scoer", "column 'scoer', expected known columns only; did you mean"),
    ("twice", HEADER + ",x", "line 1: found the column 'x' twice"),
    ("category", f"{HEADER}\n{GOOD}\nbede,0,0,0,1,1,1,0", "line 3, column category: found 'bede'"),
    ("text", f"{HEADER}\nbed,a,0,0,1,1,1,0", "line 2, column x: found 'a', expected metres"),
    ("blank cell", f"{HEADER}\nbed,,0,0,1,1,1,0", "line 2, column x: found ''"),
    ("nan", f"{HEADER}\nbed,0,nan,0,1,1,1,0", "line 2, column y: found 'nan'"),
    ("inf", f"{HEADER}\nbed,0,inf,0,1,1,1,0", "line 2, column y: found 'inf'"),
    ("zero", f"{HEADER}\nbed,0,0,0,1,0,1,0", "line 2, column depth: found '0', expected metres"),
    ("degrees", f"{HEADER}\nbed,0,0,0,1,1,1,90", "line 2, column yaw: found '90', expected rad"),
    ("decimal comma", f'{HEADER}\nbed,"0,5",0,0,1,1,1,0', "write decimals with a point"),
    ("short line", f"{HEADER}\nbed,0,0,0,1,1,1", "line 2: found 7 values, expected 8"),
    ("quote", f'{HEADER}\n"bed,0,0,0,1,1,1', "a CSV table"),
    ("same id", f"id,{HEADER}\na,{GOOD}\na,{GOOD}", "line 3, column id: found 'a'"),
    ("score", f"{HEADER},score\n{GOOD},2", "line 2, column score: found '2', expected a score"),
    ("null byte", f"{HEADER}\nbed,\0,0,0,1,1,1,0", "line 2"),
]


@pytest.mark.parametrize(
    ("text", "expected"), [case[1:] for case in BAD_TABLES], ids=[case[0] for case in BAD_TABLES]
)
def test_bad_table(tmp_path: Path, text: str, expected: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(SceneFormatError) as caught:
        read_box_table(path)
    assert str(caught.value).startswith(str(path))
    assert expected in str(caught.value)


def test_bad_files(tmp_path: Path) -> None:
    with pytest.raises(SceneFormatError, match=r"none\.csv: the path: found No such file"):
        read_box_table(tmp_path / "none.csv")
    with pytest.raises(SceneFormatError, match="directory"):
        read_box_table(tmp_path)
    path = tmp_path / "boxes.csv"
    path.write_bytes(HEADER.encode("utf-16"))
    with pytest.raises(SceneFormatError, match="UTF-8"):
        read_box_table(path)


def test_scene_from_boxes_derives_what_is_missing(room: Layout) -> None:
    boxes = OrientedBoxes(
        torch.tensor([[0.0, 1.0, 0.3]]), torch.tensor([[1.6, 2.0, 0.6]]), torch.zeros(1)
    )
    objects = objects_from_boxes(boxes, torch.tensor([2]), camera_height=1.2)
    scene = scene_from_boxes(objects, room, camera_height=1.2, name="cell")
    assert scene.panorama == Panorama(1024, 512, 1.2)
    assert scene.relations is not None
    assert scene.relations.touching_wall.tolist() == [[0, 0, 1, 0]]
    assert scene.name == "cell"
    photo = Panorama(2048, 1024, 1.2, "photo.jpg")
    assert scene_from_boxes(objects, room, camera_height=1.2, panorama=photo).panorama == photo


def test_contradictions_are_refused(room: Layout) -> None:
    boxes = OrientedBoxes(torch.zeros(2, 3), torch.ones(2, 3), torch.zeros(2))
    with pytest.raises(ValueError, match="category: expected 2, one for each box, found 1"):
        objects_from_boxes(boxes, ["bed"])
    with pytest.raises(ValueError, match="id: expected 2"):
        objects_from_boxes(boxes, ["bed", "bed"], id=("a",))
    with pytest.raises(ValueError, match="did you mean 'bed'"):
        objects_from_boxes(boxes, ["bed", "bde"])
    objects = objects_from_boxes(boxes, ["bed", "bed"])
    with pytest.raises(ValueError, match=r"expected 1\.6 as in panorama, found 1\.5"):
        scene_from_boxes(objects, room, camera_height=1.5, panorama=Panorama(64, 32))
