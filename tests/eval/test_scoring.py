"""Predictions to disk, scores from disk, pages from scores."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from panoscene.cli import main
from panoscene.eval import (
    METHODS,
    Inputs,
    Measured,
    Method,
    ScoreFile,
    export_predictions,
    read_manifest,
    read_scores,
    relation_record,
    results_page,
    run_score_benchmark,
    sample_targets,
    score_benchmark_table,
    score_folder,
    score_relations,
    summary_table,
    write_scores,
)
from panoscene.scene import Scene, SceneFormatError, Shapes, box_mesh, read_scene
from panoscene.synth import sample_room

CHOSEN = ("estimates", "default", "mean-box", "truth", "default-180")


@pytest.fixture(scope="module")
def export(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return an export of three sampled rooms."""
    output = tmp_path_factory.mktemp("export")
    methods = {name: METHODS[name] for name in CHOSEN}
    export_predictions(output, sample_targets(3, 11), seed=11, methods=methods, data="three rooms")
    return output


@pytest.fixture(scope="module")
def truth(export: Path) -> ScoreFile:
    """Return the scores of the targets themselves."""
    return score_folder(export / "predictions" / "truth", export / "targets", replicates=0)


def test_an_export_holds_targets_predictions_and_how_they_were_made(export: Path) -> None:
    facts = json.loads((export / "export.json").read_text())
    assert facts["scenes"] == 3
    assert set(facts["methods"]) == set(CHOSEN)
    assert facts["methods"]["default-180"]["fov_deg"] == 180
    assert facts["methods"]["default"]["fov_deg"] == 360
    for name in CHOSEN:
        for target in (export / "targets").glob("*.json"):
            prediction = read_scene(export / "predictions" / name / target.name)
            assert prediction.name == target.stem


def test_targets_do_not_depend_on_their_number() -> None:
    few, more = sample_targets(1, 3), sample_targets(2, 3)
    assert few[0].objects.boxes.centre.equal(more[0].objects.boxes.centre)


def test_the_truth_is_perfect_and_the_trivial_baseline_is_not(
    export: Path, truth: ScoreFile
) -> None:
    trivial = score_folder(export / "predictions" / "mean-box", export / "targets", replicates=0)
    for name in (
        "detection.ap_50_mean_57",
        "detection.recall_50",
        "layout.regularised.overall.iou_3d",
        "semantic.mean",
    ):
        assert truth.metrics[name].value == pytest.approx(1.0, abs=1e-6), name
        value = trivial.metrics[name].value
        assert value is None or value < 0.9, name
    assert truth.metrics["plausibility.paper_colliding_pairs"].value == 0


def test_a_missing_prediction_counts_as_an_empty_room(export: Path, tmp_path: Path) -> None:
    names = sorted(path.name for path in (export / "targets").glob("*.json"))
    for name in names[1:]:
        (tmp_path / name).write_bytes((export / "predictions" / "truth" / name).read_bytes())
    score = score_folder(tmp_path, export / "targets", replicates=0)
    counts = [len(read_scene(export / "targets" / name).objects.boxes) for name in names]
    assert (score.scenes, score.missing) == (3, 1)
    recall = score.metrics["detection.recall_15"].value
    assert recall == pytest.approx(sum(counts[1:]) / sum(counts))
    iou = score.metrics["layout.regularised.overall.iou_2d"].value
    assert iou == pytest.approx(2 / 3, abs=1e-6)
    assert score.metrics["layout.regularised.overall.degenerate"].value == 1


def test_a_prediction_without_a_target_is_refused(export: Path, tmp_path: Path) -> None:
    target = next((export / "targets").glob("*.json"))
    (tmp_path / "other.json").write_bytes(target.read_bytes())
    with pytest.raises(SceneFormatError, match=r"other\.json"):
        score_folder(tmp_path, export / "targets")


def test_a_prediction_without_relations_has_no_relation_scores(
    export: Path, tmp_path: Path
) -> None:
    for path in (export / "predictions" / "estimates").glob("*.json"):
        document = json.loads(path.read_text())
        del document["relations"]
        (tmp_path / path.name).write_text(json.dumps(document))
    score = score_folder(tmp_path, export / "targets", replicates=0)
    assert not [name for name in score.metrics if name.startswith("relations.")]
    assert "fidelity.touching_f1" in score.metrics


@pytest.mark.usefixtures("unchecked")
def test_intervals_hold_their_value_and_are_reproducible(export: Path) -> None:
    folder = export / "predictions" / "estimates"
    first, second = (
        score_folder(folder, export / "targets", replicates=8, seed=4) for _ in range(2)
    )
    assert first == second
    measured = first.metrics["layout.regularised.overall.iou_2d"]
    assert measured.value is not None
    assert measured.low is not None
    assert measured.high is not None
    assert measured.low <= measured.value <= measured.high


@pytest.mark.usefixtures("unchecked")
def test_the_commands_write_results_and_notice_stale_pages(
    export: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    results, page, readme = tmp_path / "results", tmp_path / "RESULTS.md", tmp_path / "README.md"
    readme.write_text("before\n<!-- results:begin -->\n<!-- results:end -->\nafter\n")
    arguments = ["eval", "score", str(export), "-o", str(results), "--replicates", "0"]
    assert main([*arguments, "--workers", "1"]) == 0
    assert {path.stem for path in results.glob("*.json")} == set(CHOSEN)
    report = ["eval", "report", str(results), "-o", str(page), "--readme", str(readme)]
    assert main([*report, "--check"]) == 2
    assert not page.exists()
    assert main(report) == 0
    assert main([*report, "--check"]) == 0
    assert "three rooms" in page.read_text()
    assert readme.read_text().startswith("before\n<!-- results:begin -->\n| method |")
    assert read_scores(results / "default-180.json").fov_deg == 180
    assert "`default-180`" not in summary_table([read_scores(p) for p in results.glob("*.json")])
    readme.write_text(readme.read_text().replace("`truth`", "`lies`"))
    capsys.readouterr()
    assert main([*report, "--check"]) == 2
    assert "README.md" in capsys.readouterr().err


def test_scores_on_other_targets_do_not_share_a_table(truth: ScoreFile) -> None:
    other = truth.model_copy(update={"targets_hash": "0" * 16})
    with pytest.raises(ValueError, match="other targets"):
        results_page([truth, other])
    with pytest.raises(ValueError, match="no files"):
        results_page([])


def test_files_of_scores_come_back_and_bad_ones_are_named(truth: ScoreFile, tmp_path: Path) -> None:
    write_scores(truth, tmp_path / "a.json")
    assert read_scores(tmp_path / "a.json") == truth
    lines = (tmp_path / "a.json").read_text().splitlines()
    assert len(lines) < len(truth.metrics) + len(truth.categories) + 30
    assert json.loads("\n".join(lines))["metrics"].keys() == truth.metrics.keys()
    (tmp_path / "b.json").write_text('{"schema": "panoscene/score", "version": 2}')
    with pytest.raises(SceneFormatError, match=r"b\.json"):
        read_scores(tmp_path / "b.json")


def test_scores_without_a_field_of_view_are_of_whole_rooms(
    truth: ScoreFile, tmp_path: Path
) -> None:
    write_scores(truth, tmp_path / "a.json")
    old = json.loads((tmp_path / "a.json").read_text())
    del old["fov_deg"]
    (tmp_path / "a.json").write_text(json.dumps(old))
    assert read_scores(tmp_path / "a.json").fov_deg == 360


def test_each_part_of_the_targets_is_scored_by_itself(export: Path) -> None:
    names = sorted(path.stem for path in (export / "targets").glob("*.json"))
    parts = {name: "even" if k % 2 == 0 else "odd" for k, name in enumerate(names)}
    folders = export / "predictions" / "estimates", export / "targets"
    found = score_folder(*folders, parts=parts, replicates=0)
    counts = [
        part["layout.regularised.overall.scenes"].value or 0.0 for part in found.parts.values()
    ]
    assert sum(counts) == len(names)
    recalls = [part["detection.recall_15"].value or 0.0 for part in found.parts.values()]
    assert min(recalls) <= (found.metrics["detection.recall_15"].value or 0.0) <= max(recalls)
    assert score_folder(*folders, parts=dict.fromkeys(names, "all"), replicates=0).parts == {}


@pytest.mark.usefixtures("unchecked")
def test_weak_relations_come_with_the_same_boxes(tmp_path: Path) -> None:
    taken: list[Inputs] = []

    def take(inputs: Inputs) -> list[Scene]:
        taken.append(inputs)
        return list(inputs.estimates)

    methods = {"spy": Method("input", "keeps what it gets", take)}
    targets = sample_targets(4, 5)
    export_predictions(tmp_path, targets, seed=5, methods=methods)
    ((estimates, weak),) = [(t.estimates, t.with_weak_relations) for t in taken]
    for one, other in zip(estimates, weak, strict=True):
        assert one.objects.boxes.centre.equal(other.objects.boxes.centre)
        assert one.objects.category.equal(other.objects.category)
        assert one.layout.floor_polygon.equal(other.layout.floor_polygon)
    good, bad = (
        score_relations([relation_record(*pair) for pair in zip(scenes, targets, strict=True)])
        for scenes in (estimates, weak)
    )
    assert (good["touching_f1"] or 0) > 0.75
    assert (bad["touching_f1"] or 1) < 0.65


def test_a_damaged_manifest_is_named(export: Path, tmp_path: Path) -> None:
    (tmp_path / "export.json").write_text('{"methods": {"a": {}}}')
    with pytest.raises(SceneFormatError, match=r"export\.json"):
        read_manifest(tmp_path / "export.json")
    assert main(["eval", "score", str(tmp_path)]) == 2
    methods = read_manifest(export / "export.json").methods
    assert methods["truth"].kind == "oracle"


@pytest.mark.usefixtures("unchecked")
def test_meshes_of_the_targets_become_tables(tmp_path: Path) -> None:
    room = replace(sample_room(np.random.default_rng(2), objects=4), name="room")
    meshes = Shapes(mesh=(box_mesh(),) * len(room.objects.boxes))
    room = replace(room, objects=replace(room.objects, shapes=meshes))
    methods = {name: METHODS[name] for name in ("mean-box", "truth")}
    export_predictions(tmp_path, [room], methods=methods)
    arguments = ["eval", "score", str(tmp_path), "-o", str(tmp_path / "scores"), "--shapes"]
    assert main([*arguments, "--replicates", "0", "--workers", "1"]) == 0
    page = results_page([read_scores(path) for path in (tmp_path / "scores").glob("*.json")])
    shapes = page.split("\n## Shapes\n")[1]
    assert f"| `truth` | oracle | {len(room.objects.boxes)} |" in shapes
    assert "| `mean-box` | baseline |" in page.split("\n## Mesh penetration\n")[1]
    assert "What is not here" not in page


def test_cells_say_when_there_is_no_number() -> None:
    assert Measured(value=None).low is None


@pytest.mark.parametrize(
    "arguments",
    [
        ["eval", "export", "-o", "OUT", "--methods", "magic"],
        ["eval", "export", "-o", "OUT", "--scenes", "0"],
        ["eval", "score", "nowhere"],
        ["eval", "score", "OUT"],
        ["eval", "report", "OUT"],
    ],
)
def test_bad_requests_end_with_one_message(
    arguments: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = [str(tmp_path) if word == "OUT" else word for word in arguments]
    assert main(arguments) == 2
    assert capsys.readouterr().err.count("error") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.usefixtures("unchecked")
def test_the_benchmark_scores_as_many_rooms_as_it_says() -> None:
    result = run_score_benchmark(repeats=2, scenes=2, objects=3, workers=1, replicates=2)
    seconds = result["seconds"]
    assert isinstance(seconds, list)
    assert len(seconds) == 2
    assert min(seconds) <= result["score_2_scenes_s"] <= max(seconds)
    assert "2 scenes of 3 objects" in score_benchmark_table(result)
    with pytest.raises(ValueError, match="workers"):
        run_score_benchmark(workers=0)


def test_methods_are_compared_with_those_that_the_export_names(
    export: Path, tmp_path: Path
) -> None:
    folder = tmp_path / "export"
    shutil.copytree(export, folder)
    facts = json.loads((folder / "export.json").read_text())
    facts["methods"]["default"]["compared_with"] = ["mean-box", "estimates", "not there"]
    (folder / "export.json").write_text(json.dumps(facts))
    results = str(tmp_path / "results")
    assert main(["eval", "score", str(folder), "-o", results, "--replicates", "20"]) == 0
    found = {name: read_scores(tmp_path / "results" / f"{name}.json") for name in CHOSEN}
    differences = found["default"].differences
    assert list(differences) == ["mean-box", "estimates"]
    assert [name for name in CHOSEN if found[name].differences] == ["default"]
    for other, metrics in differences.items():
        ours, theirs = found["default"].metrics, found[other].metrics
        first, second = (some["detection.recall_15"].value for some in (ours, theirs))
        assert first is not None
        assert second is not None
        assert metrics["detection.recall_15"].value == pytest.approx(first - second)
