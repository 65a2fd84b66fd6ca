"""Predictions that are not valid: they cost scores, and never stop the scoring."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from panoscene.cli import main
from panoscene.eval import (
    METHODS,
    ScoreFile,
    export_predictions,
    read_scores,
    sample_targets,
    score_folder,
)
from panoscene.eval._predictions import read_prediction
from panoscene.scene import SceneFormatError, read_scene

BOW_TIE = [[-2.0, -2.0], [2.0, 2.0], [2.0, -2.0], [-2.0, 2.0]]
FLOOR_AREA = "layout.regularised.overall.iou_2d"
DEGENERATE = "layout.regularised.overall.degenerate"
RECALL = "detection.recall_15"
TOUCHING_WALL = "relations.touching_wall_tpr_end_to_end"

Document = dict[str, Any]


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an export of three sampled rooms, with the truth as the only prediction."""
    output = tmp_path_factory.mktemp("export")
    export_predictions(output, sample_targets(3, 11), seed=11, methods={"truth": METHODS["truth"]})
    for path in (output / "predictions" / "truth").glob("*.json"):
        document = json.loads(path.read_text())
        document["layout"]["raw_polygon"] = document["layout"]["floor_polygon"]
        path.write_text(json.dumps(document))
    return output


@pytest.fixture(scope="module")
def undamaged(export: Path) -> ScoreFile:
    return score_folder(export / "predictions" / "truth", export / "targets", replicates=0)


def damaged(export: Path, folder: Path, damage: Callable[[Document], object]) -> Path:
    """Write the predictions to a folder, the first of them damaged, and return its path."""
    paths = sorted((export / "predictions" / "truth").glob("*.json"))
    for path in paths:
        document = json.loads(path.read_text())
        if path == paths[0]:
            changed = damage(document)
            document = document if changed is None else changed
        text = document if isinstance(document, str) else json.dumps(document)
        (folder / path.name).write_text(text)
    return folder / paths[0].name


def score(export: Path, folder: Path) -> tuple[ScoreFile, list[str]]:
    warnings: list[str] = []
    scores = score_folder(folder, export / "targets", replicates=0, warn=warnings.append)
    return scores, warnings


def bow_tie(document: Document) -> None:
    document["layout"]["floor_polygon"] = BOW_TIE


def bow_tie_raw(document: Document) -> None:
    document["layout"]["raw_polygon"] = BOW_TIE


def no_size(document: Document) -> None:
    document["objects"][1]["box"]["size"][0] = 0.0


def not_finite(document: Document) -> None:
    document["objects"][1]["box"]["centre"][2] = float("nan")


def unknown_wall(document: Document) -> None:
    first = document["objects"][0]["id"]
    document["relations"]["touching"][first] = {"wall-99": 1.0}


def cut_short(document: Document) -> str:
    return json.dumps(document)[:-20]


def another_schema(document: Document) -> None:
    document["schema"] = "somebody/else"


def unknown_field(document: Document) -> None:
    document["layouts"] = document["layout"]


def no_panorama(document: Document) -> None:
    document["panorama"]["width"] = -1


def a_list(document: Document) -> str:
    return json.dumps([document])


@pytest.mark.parametrize(
    ("damage", "lower"),
    [
        (bow_tie, FLOOR_AREA),
        (no_size, RECALL),
        (cut_short, RECALL),
        (unknown_wall, TOUCHING_WALL),
    ],
)
def test_the_command_scores_damaged_predictions_lower_and_names_them(
    export: Path,
    undamaged: ScoreFile,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    *,
    damage: Callable[[Document], object],
    lower: str,
) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    path = damaged(export, folder, damage)
    arguments = ["eval", "score", str(folder), "--targets", str(export / "targets")]
    arguments += ["-o", str(tmp_path / "scores"), "--replicates", "0", "--workers", "1"]
    assert main(arguments) == 0
    said = capsys.readouterr().err.splitlines()
    assert [line for line in said if "warning" in line] == [said[0]]
    assert said[0].startswith(f"warning: {path}: ")
    scores = read_scores(tmp_path / "scores" / "mine.json")
    assert (scores.scenes, scores.invalid) == (3, 1)
    assert scores.metrics.keys() == undamaged.metrics.keys()
    before, after = undamaged.metrics[lower].value, scores.metrics[lower].value
    assert before is not None
    assert after is not None
    assert 0 < after < before


def test_a_crossing_floor_costs_the_layout_and_leaves_the_objects(
    export: Path, undamaged: ScoreFile, tmp_path: Path
) -> None:
    damaged(export, tmp_path, bow_tie)
    scores, (warning,) = score(export, tmp_path)
    assert "layout counts as degenerate" in warning
    assert "cross" in warning
    for reading in ("regularised", "raw"):
        prefix = f"layout.{reading}.overall"
        assert scores.metrics[f"{prefix}.iou_2d"].value == pytest.approx(2 / 3)
        assert scores.metrics[f"{prefix}.degenerate"].value == 1
        assert scores.metrics[f"{prefix}.scenes"].value == 3
    assert scores.metrics[RECALL] == undamaged.metrics[RECALL]
    assert scores.metrics["semantic.mean"] == undamaged.metrics["semantic.mean"]
    touching = "relations.touching_f1_end_to_end"
    assert scores.metrics[touching] == undamaged.metrics[touching]
    # what was said of other walls than the target's cannot be right
    assert (scores.metrics[TOUCHING_WALL].value or 0) < 1
    assert scores.missing == 0


def test_relations_between_objects_outlive_the_walls(export: Path, tmp_path: Path) -> None:
    def fewer_walls(document: Document) -> None:
        document["layout"]["floor_polygon"] = [[0, 0], [1, 0], [2, 0]]

    path = damaged(export, tmp_path, fewer_walls)
    target = read_scene(export / "targets" / path.name)
    found = read_prediction(path, target)
    assert found.scene is not None
    assert found.scene.relations is not None
    assert target.relations is not None
    assert found.scene.relations.touching.equal(target.relations.touching)
    assert not found.scene.relations.touching_wall.any()


def test_a_crossing_raw_polygon_costs_the_raw_row_alone(
    export: Path, undamaged: ScoreFile, tmp_path: Path
) -> None:
    damaged(export, tmp_path, bow_tie_raw)
    scores, _ = score(export, tmp_path)
    changed = {name for name, value in scores.metrics.items() if value != undamaged.metrics[name]}
    assert changed
    assert all(name.startswith("layout.raw.") for name in changed)
    assert scores.metrics["layout.raw.overall.degenerate"].value == 1


@pytest.mark.parametrize("damage", [no_size, not_finite])
def test_an_object_without_a_box_is_left_out_with_its_relations(
    export: Path, tmp_path: Path, damage: Callable[[Document], object]
) -> None:
    path = damaged(export, tmp_path, damage)
    target = read_scene(export / "targets" / path.name)
    found = read_prediction(path, target)
    assert found.scene is not None
    kept = [k for k in range(len(target.objects.boxes)) if k != 1]
    assert list(found.scene.objects.id) == [target.objects.id[k] for k in kept]
    assert found.scene.layout.floor_polygon.equal(target.layout.floor_polygon)
    assert found.scene.relations is not None
    assert target.relations is not None
    assert found.scene.relations.touching.equal(target.relations.touching[kept][:, kept])
    assert found.scene.relations.touching_wall.equal(target.relations.touching_wall[kept])


def test_an_object_without_a_box_is_one_missed_object(export: Path, tmp_path: Path) -> None:
    damaged(export, tmp_path, no_size)
    scores, _ = score(export, tmp_path)
    recall = scores.metrics[RECALL].value
    assert recall == pytest.approx((scores.objects - 1) / scores.objects)
    assert scores.metrics[FLOOR_AREA].value == pytest.approx(1)
    assert (scores.missing, scores.invalid) == (0, 1)


def test_objects_without_names_keep_their_relations_when_one_is_left_out(
    export: Path, tmp_path: Path
) -> None:
    def unnamed(document: Document) -> None:
        for item in document["objects"]:
            del item["id"]
        last = len(document["objects"]) - 1
        document["relations"] = {"on_floor": {f"{document['objects'][last]['category']}-{last}": 1}}
        document["objects"][0]["box"]["size"] = [0, 0, 0]

    path = damaged(export, tmp_path, unnamed)
    scene = read_prediction(path, read_scene(export / "targets" / path.name)).scene
    assert scene is not None
    assert scene.relations is not None
    on_floor = scene.relations.on_floor.tolist()
    assert on_floor == [0.0] * (len(on_floor) - 1) + [1.0]


@pytest.mark.parametrize(
    "damage", [cut_short, another_schema, unknown_field, no_panorama, a_list, lambda _: ""]
)
def test_what_is_no_scene_counts_as_missing(
    export: Path, tmp_path: Path, damage: Callable[[Document], object]
) -> None:
    path = damaged(export, tmp_path, damage)
    target = read_scene(export / "targets" / path.name)
    found = read_prediction(path, target)
    assert (found.scene, found.invalid) == (None, True)
    assert found.warning is not None
    assert found.warning.startswith(f"{path}: ")
    assert "\n" not in found.warning


def test_an_unreadable_prediction_scores_as_a_missing_one(export: Path, tmp_path: Path) -> None:
    path = damaged(export, tmp_path, cut_short)
    unreadable, (said,) = score(export, tmp_path)
    path.unlink()
    missing, (told,) = score(export, tmp_path)
    assert unreadable.metrics == missing.metrics
    assert unreadable.metrics[DEGENERATE].value == 1
    assert (unreadable.missing, unreadable.invalid) == (1, 1)
    assert (missing.missing, missing.invalid) == (1, 0)
    assert "truncated" in said
    assert "found no prediction" in told


def test_everything_that_is_wrong_is_found_in_turn(export: Path, tmp_path: Path) -> None:
    def all_of_it(document: Document) -> None:
        for damage in (bow_tie, bow_tie_raw, no_size, unknown_wall):
            damage(document)
        document["objects"][2] = None
        document["objects"][3]["id"] = document["objects"][0]["id"]
        document["relations"]["farther_than"] = 3

    path = damaged(export, tmp_path, all_of_it)
    found = read_prediction(path, read_scene(export / "targets" / path.name))
    assert found.scene is not None
    assert found.no_layout
    assert "objects left out: 3" in (found.warning or "")


def test_targets_have_to_be_valid(export: Path, tmp_path: Path) -> None:
    damaged(export, tmp_path, bow_tie)
    with pytest.raises(SceneFormatError, match="cross"):
        score_folder(export / "predictions" / "truth", tmp_path)


def test_scores_without_a_count_of_invalid_predictions_had_none(
    undamaged: ScoreFile, tmp_path: Path
) -> None:
    document = undamaged.model_dump(by_alias=True)
    del document["invalid"]
    (tmp_path / "old.json").write_text(json.dumps(document))
    assert read_scores(tmp_path / "old.json").invalid == 0
