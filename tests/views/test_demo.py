"""The demonstration leaves scenes, certificate and pictures, and is better after than before."""

import json
from pathlib import Path

import pytest
from PIL import Image

from panoscene.sample import sample_room_path
from panoscene.scene import read_scene
from panoscene.views import run_demo


@pytest.mark.slow
def test_the_demo_repairs_the_room_and_leaves_pictures(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "demo"
    result = run_demo(folder, seed=0)
    assert {path.name for path in folder.iterdir()} == {
        "before.json", "after.json", "certificate.json",
        "before.png", "after.png", "comparison.png", "sheet.png", "report.html",
    }  # fmt: skip
    assert result.mean_iou_after > result.mean_iou_before
    assert result.colliding_pairs_after < result.colliding_pairs_before
    assert result.worst_penetration_after < result.worst_penetration_before
    assert result.out_of_room_volume_after < result.out_of_room_volume_before
    before, after = read_scene(result.before), read_scene(result.after)
    assert (before.objects.boxes.centre != after.objects.boxes.centre).any()
    certificate = json.loads(result.certificate.read_text())
    assert certificate["after"]["colliding_pairs"] == result.colliding_pairs_after
    for picture in (
        *(result.before_picture, result.after_picture),
        *(result.comparison, result.sheet),
    ):
        with Image.open(picture) as image:
            image.load()
            assert image.width >= 1200
    page = result.report.read_text()
    assert page.startswith("<!doctype html>")
    assert page.rstrip().endswith("</html>")
    assert "Sample room, disturbed and repaired" in page
    plain = json.loads(json.dumps(result.as_dict()))
    assert plain["comparison"].endswith("comparison.png")
    assert plain["sheet"].endswith("sheet.png")
    assert plain["report"].endswith("report.html")


def test_the_sample_room_is_furnished_and_sound() -> None:
    room = read_scene(sample_room_path())
    assert 14 <= len(room.objects.boxes) <= 18
    assert len(room.layout.floor_polygon) in (6, 8)
    assert room.relations is not None
    assert bool((room.relations.inside_room == 1).all())
    assert room.name == "sample room"
