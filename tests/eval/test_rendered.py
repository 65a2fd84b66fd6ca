"""What the pipeline predicts for a rendered set: rows, resuming, and what is told to whom."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.cli import main
from panoscene.eval import ROWS, export_reconstructions, match_objects
from panoscene.eval._rendered import SHAPED, predicted_rows
from panoscene.exports import write_glb
from panoscene.models.layout import LayoutPrediction
from panoscene.pipeline import Clock, Pipeline, Stages
from panoscene.scene import (
    Detections,
    Layout,
    Objects,
    Relations,
    Scene,
    Shapes,
    box_mesh,
    read_scene,
    relations_from_boxes,
    select_objects,
)
from panoscene.synth.dataset import PanoramaItem, open_dataset

SAMPLES = Path(__file__).parents[2] / "samples" / "synth"
SHIFT = 0.02
Image = Float[Tensor, "3 height width"]


@pytest.fixture(scope="module")
def item() -> PanoramaItem:
    upright = [x for x in open_dataset(SAMPLES) if x.labels().camera.pitch == 0]
    return min(upright, key=lambda x: len(x.scene().objects.boxes))


class NearlyKnowing:
    """Stages that say the truth, in a smaller room, without the last object."""

    def __init__(self, truth: Scene) -> None:
        self.truth = truth

    def detector(self, image: Image) -> Detections:
        objects = self.truth.objects
        return Detections(objects.bfov[:-1], objects.category[:-1], objects.score[:-1])

    def layout(self, image: Image, *, camera_height: float | None = None) -> LayoutPrediction:
        layout = self.truth.layout
        smaller = replace(layout, floor_polygon=layout.floor_polygon * 0.95)
        return LayoutPrediction(smaller, False, torch.zeros(2, 1024), torch.zeros(1024))

    def pose(
        self, image: Image, detections: Detections, layout: Layout | None, camera_height: float
    ) -> Objects:
        return select_objects(self.truth.objects, torch.arange(len(detections.category)))

    def context(
        self,
        image: Image,
        detections: Detections,
        layout: Layout,
        camera_height: float,
        *,
        clock: Clock,
    ) -> tuple[Objects, Relations | None]:
        objects = self.pose(image, detections, layout, camera_height)
        moved = objects.boxes.centre + torch.tensor([SHIFT, 0.0, 0.0])
        objects = replace(objects, boxes=replace(objects.boxes, centre=moved))
        return objects, relations_from_boxes(objects.boxes, layout, camera_height)

    def pipeline(self) -> Pipeline:
        return Pipeline(Stages(self.detector, self.layout, self.pose, context=self.context))


def test_each_row_is_told_what_it_says(item: PanoramaItem) -> None:
    truth = replace(item.scene(), name=item.name)
    rows = predicted_rows(item, truth, NearlyKnowing(truth).pipeline())
    assert set(rows) == set(ROWS)
    count = len(truth.objects.boxes)
    found = {name: len(scene.objects.boxes) for name, scene in rows.items()}
    everything = {"true-detections", "true-boxes", "true-relations"}
    assert found == {name: count if name in everything else count - 1 for name in ROWS}
    in_true_room = {
        name
        for name, scene in rows.items()
        if torch.equal(scene.layout.floor_polygon, truth.layout.floor_polygon)
    }
    assert in_true_room == {"true-layout", "true-relations"}
    centre = truth.objects.boxes.centre[:-1]
    assert torch.equal(rows["pose"].objects.boxes.centre, centre)
    moved = rows["without-arrangement"].objects.boxes.centre - centre
    assert torch.allclose(moved[:, 0], torch.tensor(SHIFT), atol=1e-5)
    exact = match_objects(rows["true-boxes"].objects, truth.objects, iou_threshold=0.99)
    assert int((exact >= 0).sum()) == count
    assert all(scene.name == item.name for scene in rows.values())


def test_what_is_done_is_kept_and_other_sources_are_refused(
    item: PanoramaItem, tmp_path: Path
) -> None:
    pipeline = NearlyKnowing(item.scene()).pipeline()
    sources = {"pose": "a"}
    first = export_reconstructions(tmp_path, [item], pipeline, data="rendered", sources=sources)
    again = export_reconstructions(tmp_path, [item], pipeline, data="rendered", sources=sources)
    assert (first, again) == (1, 0)
    manifest = json.loads((tmp_path / "export.json").read_text())
    assert manifest["scenes"] == 1
    assert set(manifest["methods"]) == set(ROWS)
    assert manifest["parts"] == {item.name: item.split}
    assert all((tmp_path / "predictions" / n / f"{item.name}.json").is_file() for n in ROWS)
    score = ["eval", "score", str(tmp_path), "-o", str(tmp_path / "scores")]
    assert main([*score, "--replicates", "0", "--workers", "1"]) == 0
    with pytest.raises(ValueError, match="another pipeline"):
        export_reconstructions(tmp_path, [item], pipeline, data="rendered", sources={"pose": "b"})


def test_the_command_refuses_what_it_cannot_use(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["eval", "reconstruct", str(SAMPLES), "-o", str(tmp_path / "run")]
    assert main([*command, "--weights", str(tmp_path / "none")]) == 2
    assert "found no folder" in capsys.readouterr().err
    assert main(["eval", "reconstruct", str(tmp_path), "-o", str(tmp_path / "run")]) == 2
    assert not (tmp_path / "run").exists()


def test_meshes_of_the_set_reach_the_targets(
    item: PanoramaItem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    truth = item.scene()
    stages = NearlyKnowing(truth).pipeline().stages
    folder = tmp_path / "set" / item.name
    copytree(item.folder, folder)
    item = replace(item, folder=folder)

    def cubes(image: Image, objects: Objects, *, resolution: int = 64) -> Shapes:
        return Shapes(mesh=tuple(box_mesh() for _ in range(len(objects.boxes))))

    shown = replace(truth.objects, shapes=cubes(item.image(), truth.objects))
    write_glb(replace(truth, objects=shown), folder / "scene.glb")

    def loaded(*_: object, shapes: bool, **__: object) -> Pipeline:
        return Pipeline(replace(stages, shape=cubes if shapes else None))

    monkeypatch.setattr("panoscene.cli._eval.load", loaded)
    monkeypatch.setattr("panoscene.cli._eval.open_dataset", _only(item))
    run = [
        "eval",
        "reconstruct",
        str(SAMPLES),
        "-o",
        str(tmp_path / "run"),
        "--shapes",
        "--split",
        "val",
    ]
    assert main(run) == 0
    target = read_scene(tmp_path / "run" / "targets" / f"{item.name}.json").objects
    assert all(mesh is not None for mesh in target.shapes.mesh)
    assert torch.equal(target.boxes.centre, truth.objects.boxes.centre)
    for row in ROWS:
        found = read_scene(
            tmp_path / "run" / "predictions" / row / f"{item.name}.json"
        ).objects.shapes
        assert bool(found.mesh) == (row in SHAPED), row
    rows = ["--targets", str(tmp_path / "run" / "targets"), "-o", str(tmp_path / "scores")]
    score = ["eval", "score", str(tmp_path / "run" / "predictions" / "full"), *rows, "--shapes"]
    assert main([*score, "--replicates", "0", "--workers", "1"]) == 0
    full = json.loads((tmp_path / "scores" / "full.json").read_text())["metrics"]
    assert full["shape.targets"]["value"] == len(truth.objects.boxes)


def _only(item: PanoramaItem) -> Callable[..., object]:
    class One(list[PanoramaItem]):
        info = open_dataset(SAMPLES).info

    return lambda *_: One([item])
