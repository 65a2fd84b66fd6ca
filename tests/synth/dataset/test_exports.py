"""Exports, statistics and pictures of a set."""

import json
import math
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from panoscene.geometry import boundary_from_layout
from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import (
    DatasetError,
    PanoramaItem,
    category_sheet,
    contact_sheet,
    data_card,
    dataset_statistics,
    decode_mask,
    export_coco,
    export_crops,
    export_horizonnet,
    horizonnet_corners,
    open_dataset,
    write_category_sheets,
    write_contact_sheets,
    write_data_card,
)


def test_coco_masks_and_boxes_are_those_of_the_instances(small_set: Path, tmp_path: Path):
    files = export_coco(small_set, tmp_path)
    assert [file.name for file in files] == [
        f"instances_{split}.json" for split in ("train", "val", "test-seen", "test-unseen")
    ]
    dataset = {item.name: item for item in open_dataset(small_set)}
    wrapped = 0
    for file in files:
        document = json.loads(file.read_text())
        assert [c["name"] for c in document["categories"]] == list(CATEGORIES)
        (image,) = document["images"]
        assert (small_set / image["file_name"]).is_file()
        instance = dataset[image["file_name"].split("/")[1]].instance().numpy()
        assert document["annotations"]
        for annotation in document["annotations"]:
            mask = decode_mask(**annotation["segmentation"])
            number = int(annotation["panoscene"]["id"].rsplit("-", 1)[1])
            np.testing.assert_array_equal(mask, instance == number)
            x, y, wide, high = annotation["bbox"]
            rows, columns = np.nonzero(mask)
            assert (x, y) == (columns.min(), rows.min())
            assert (x + wide - 1, y + high - 1) == (columns.max(), rows.max())
            assert annotation["area"] == mask.sum()
            wrapped += annotation["bbox_circular"] != annotation["bbox"]
    assert wrapped > 0


def test_horizonnet_corners_lie_on_the_boundary(small_set: Path):
    """At a visible corner the boundary of the column has the corner's latitude."""
    for item in open_dataset(small_set):
        scene = item.scene()
        corners = horizonnet_corners(scene)
        ceiling, floor = boundary_from_layout(
            scene.layout.floor_polygon, 0.0, scene.layout.ceiling_height,
            scene.panorama.camera_height, scene.panorama.width,
        )  # fmt: skip
        x = corners[::2, 0]
        assert x.argmin() == 0
        assert (np.diff(x) > 0).all()  # a rectangle hides no corner, and lon runs clockwise
        for lat, rows in ((ceiling, corners[::2, 1]), (floor, corners[1::2, 1])):
            expected = (0.5 - lat.numpy() / math.pi) * scene.panorama.height - 0.5
            near = expected[np.rint(x).astype(int) % scene.panorama.width]
            np.testing.assert_allclose(rows, near, atol=1.0)


def test_horizonnet_folders_have_a_picture_for_each_text(small_set: Path, tmp_path: Path):
    files = export_horizonnet(small_set, tmp_path)
    assert len(files) == 4
    for file in files:
        assert np.loadtxt(file).shape == (8, 2)
        picture = file.parents[1] / "img" / f"{file.stem}.jpg"
        assert picture.is_file()


def test_crops_name_model_and_bfov(small_set: Path, tmp_path: Path):
    files = export_crops(small_set, tmp_path, most_hidden=1.0)
    lines = [json.loads(line) for file in files for line in file.read_text().splitlines()]
    assert lines
    assert not any(line["model"].startswith("shell/") for line in lines)
    fewer = export_crops(small_set, tmp_path, most_hidden=0.0)
    few = [json.loads(line) for file in fewer for line in file.read_text().splitlines()]
    assert 0 < len(few) < len(lines)
    assert all(line["occlusion"] == 0.0 for line in few)


@pytest.mark.parametrize("export", [export_coco, export_horizonnet, export_crops])
@pytest.mark.parametrize("name", ["rgb.jpg", "instance.png"])
def test_damaged_pictures_are_not_exported(
    small_set: Path,
    tmp_path: Path,
    export: Callable[[Path, Path], list[Path]],
    name: str,
):
    root, out = tmp_path / "set", tmp_path / "out"
    shutil.copytree(small_set, root)
    file = open_dataset(root)[-1].folder / name
    whole = file.read_bytes()
    middle = len(whole) // 2
    for damaged in (whole[:middle], whole[:middle] + b"\0" * 9 + whole[middle + 9 :], b""):
        file.write_bytes(damaged)
        with pytest.raises(DatasetError, match=f"{name}: expected the file that was written"):
            export(root, out)
    file.unlink()
    with pytest.raises(DatasetError, match=f"{name}: expected a file of"):
        export(root, out)
    assert not out.exists()


def test_statistics_count_what_is_there(small_set: Path):
    found = dataset_statistics(small_set)
    items = list(open_dataset(small_set))
    scenes = [item.scene() for item in items]
    assert found["panoramas"] == found["homes"] == 4
    assert found["corner_counts"] == {"4": 4}
    assert found["room_area"]["mean"] == pytest.approx(20.0, abs=1e-3)
    assert sum(found["categories"].values()) == sum(len(s.objects.category) for s in scenes)
    assert found["visible_objects_mean"] == np.mean([len(s.objects.category) for s in scenes])
    assert found["splits"] == {"train": 1, "val": 1, "test-seen": 1, "test-unseen": 1}
    touching = sum(float(s.relations.touching.sum()) / 2 for s in scenes if s.relations)
    assert found["relations"]["touching"] == pytest.approx(touching / 4, abs=1e-3)
    assert sum(found["relations"]["relative_yaw_deg_share"].values()) == pytest.approx(1, abs=5e-3)
    assert sum(found["occlusion_shares"].values()) == pytest.approx(1.0, abs=5e-3)
    assert found["lights"] == {"overcast": 4}
    json.dumps(found)


def test_the_card_has_every_category(small_set: Path):
    card = data_card(small_set)
    assert card.startswith("# panoscene-synth\n")
    for category in ("wall clock", "cabinet, no top", "sofa"):
        assert f"| {category} |" in card
    assert write_data_card(small_set).read_text() == card


def test_the_card_lists_the_files_that_are_there(small_set: Path, tmp_path: Path):
    root = tmp_path / "set"
    shutil.copytree(small_set, root)
    first = open_dataset(root)[0].folder
    listed = {line.split("`")[1] for line in data_card(root).splitlines() if line[:3] == "| `"}
    assert listed == {path.name for path in first.iterdir()}
    (first / "scene.glb").write_bytes(b"")
    assert "| `scene.glb` |" in data_card(root)


@pytest.mark.parametrize("layer", ["rgb", "objects", "distance", "semantic"])
def test_contact_sheets_show_every_panorama(small_set: Path, layer):
    sheet = contact_sheet(small_set, layer=layer, columns=2, width=128)
    assert sheet.width > 256
    tiles = [
        np.asarray(sheet)[30:80, left : left + 120].std() for left in (10, sheet.width // 2 + 6)
    ]
    assert min(tiles) > 5


def test_sheets_are_written_in_parts(small_set: Path, tmp_path: Path):
    files = write_contact_sheets(small_set, tmp_path, each=3)
    assert [file.name for file in files] == ["rgb-000.jpg", "rgb-001.jpg"]
    with pytest.raises(ValueError, match="nobody"):
        contact_sheet(small_set, names=["nobody"])


def test_category_sheets_mark_the_front(small_set: Path):
    sheet = category_sheet(small_set, "chair", count=2, size=120)
    assert sheet is not None
    pixels = np.asarray(sheet).astype(int)
    red = (pixels[..., 0] > 180) & (pixels[..., 1] < 40) & (pixels[..., 2] < 60)
    assert red.sum() > 20
    assert category_sheet(small_set, "piano") is None
    with pytest.raises(ValueError, match="throne"):
        category_sheet(small_set, "throne")


def test_sheets_of_all_categories_are_those_of_each(small_set: Path, tmp_path: Path, monkeypatch):
    reads: list[str] = []
    labels = PanoramaItem.labels
    monkeypatch.setattr(
        PanoramaItem, "labels", lambda item: reads.append(item.name) or labels(item)
    )
    files = write_category_sheets(small_set, tmp_path, count=2, size=64)
    assert len(reads) == len(open_dataset(small_set))
    shown = dataset_statistics(small_set)["categories"]
    assert {f.stem.removeprefix("category-") for f in files} <= {c for c, n in shown.items() if n}
    with Image.open(tmp_path / "category-chair.jpg") as written:
        sheet = category_sheet(small_set, "chair", count=2, size=64)
        assert sheet is not None
        assert written.size == sheet.size
        assert np.abs(np.asarray(written, float) - np.asarray(sheet, float)).mean() < 8
