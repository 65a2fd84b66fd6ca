"""Scores the relation graph network: writes benchmarks/context.json and its model card.

    python benchmarks/context.py DATA ESTIMATES [--split val] [--weights FILE] [--pose FILE]
    python benchmarks/context.py DATA ESTIMATES --joint RUN_FOLDER

ESTIMATES is the output of ``panoscene precompute --records`` with the same pose weights. Without
files the weights that come with the package are scored, with detections and with true BFoVs, in
the estimated layouts. Results of a split other than val go into benchmarks/context-SPLIT.json and
leave the card alone.

``--joint`` scores both networks of a training of step ``joint``, beside which those it began from
stand in the card: it writes benchmarks/context-joint.json, and the card anew.
"""

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import ablation
import torch

from panoscene.data import read_context_scenes, read_estimate_records
from panoscene.eval import machine_facts, relation_record, score_relations
from panoscene.models import CheckpointError, read_weights_header, shipped_weights
from panoscene.models.context import load_context_stage
from panoscene.models.pose import load_pose_stage
from panoscene.models.shape import CONFIGS as SHAPE_CONFIGS
from panoscene.pipeline import PHOTO
from panoscene.scene import Scene, write_atomically
from panoscene.synth.dataset import open_dataset
from panoscene.train._context_scores import (
    arranged,
    box_scores,
    relation_scores,
    with_oracle,
    with_rule,
)
from panoscene.train._context_views import View, said_by, viewed_scenes
from panoscene.train._precompute_estimates import check_estimates, file_hash

ROOT = Path(__file__).resolve().parents[1]
CARD = ROOT / "model_cards" / "context-compact.md"
OUTPUT = ROOT / "benchmarks" / "context.json"
JOINT = ROOT / "benchmarks" / "context-joint.json"
ROWS = {
    "pose": "pose network alone",
    "pose_arranged": "pose network, arranged by the geometric rule's relations",
    "context": "context network, not arranged",
    "full": "context network, arranged",
    "oracle": "context network, arranged with true relations",
}
VIEWS: dict[View, str] = {"found": "Detections", "true": "True BFoVs"}
RELATIONS = {
    "touching_f1": "touching", "touching_wall_f1": "touching a wall", "on_floor_f1": "on the floor",
    "inside_room_f1": "inside the room", "farther_than_f1": "farther away",
    "relative_yaw_error_deg": "yaw between objects",
    "relative_yaw_wall_error_deg": "yaw to walls",
}  # fmt: skip


def measure(
    data: Path,
    estimates: Path,
    split: str,
    weights: Path,
    pose: Path,
    *,
    encoder: Path | None = None,
) -> dict:
    """Return scores of all ways to go on from the first stages, and how long it takes.

    ``encoder`` are the pose weights behind the estimates, when ``pose`` has the same encoder.
    """
    check_estimates(estimates, data, "compact", encoder or pose)
    scenes = read_context_scenes(open_dataset(data, split)[:], read_estimate_records(estimates))
    context, network = load_context_stage(weights=weights), load_pose_stage(weights=pose).network
    shape = SHAPE_CONFIGS["compact"] if context.network.config.codes else None
    result: dict = {"split": split, "panoramas": len(scenes), "views": {}}
    with torch.inference_mode():
        for view in VIEWS:
            seen = viewed_scenes(scenes, view, network.mean_size)
            said = said_by(network)
            first = with_rule(seen.initial(said, shape))
            start, busy = time.perf_counter(), time.process_time()
            refined = seen.refined(context.network, said, shape)
            count = int(seen.batch["valid"].sum())
            seconds = (time.perf_counter() - start) * 20 / count
            processor = (time.process_time() - busy) * 20 / count
            rows = {
                "pose": first,
                "pose_arranged": arranged(first, PHOTO),
                "context": refined,
                "full": arranged(refined, PHOTO),
                "oracle": arranged(with_oracle(refined, seen.truth), PHOTO),
            }
            result["views"][view] = {
                "objects": count,
                "rows": {name: _scores(found, seen.truth) for name, found in rows.items()},
                "seconds_for_20_objects": seconds,
                "processor_seconds_for_20_objects": processor,
            }
    return result | {"machine": machine_facts()}


def _scores(found: Sequence[Scene], truth: Sequence[Scene]) -> dict[str, float | None]:
    """Return scores of boxes and relations; ``matched_`` are those of RESULTS.md, by the boxes."""
    by_box = score_relations(
        [relation_record(scene, target) for scene, target in zip(found, truth, strict=True)]
    )
    chosen = {f"matched_{name}": by_box[name] for name in RELATIONS}
    return box_scores(found, truth) | relation_scores(found, truth) | chosen


def card(result: Mapping, weights: Path) -> str:
    """Return the model card."""
    header = read_weights_header(weights)
    recipe, done = header.recipe, int(header.metrics.get("step", 0))
    options = recipe.get("options", {})
    seconds = result["views"]["true"]["processor_seconds_for_20_objects"]
    lines = [
        "# Model card: context, compact edition", "",
        "<!-- made by benchmarks/context.py; do not edit -->", "",
        "Refines boxes in view of each other and of the walls, and says how they are related: the",
        "paper's relation graph network. See [docs/context.md](../docs/context.md).", "",
        "| | |", "| --- | --- |",
        f"| file | `{weights.name}`, {weights.stat().st_size / 1e6:.1f} MB |",
        f"| network | {header.config['width']} numbers for each node,"
        f" {header.config['steps']} rounds of messages |",
        f"| trained | step `{options.get('step')}`: {done} steps of {recipe.get('batch_size')}"
        f" scenes, seed {header.seed} |",
        f"| data | rendered panoramas of our own, index hash `{header.data_hash[:16]}` |",
        f"| scored on | {result['panoramas']} panoramas of `{result['split']}`, homes that training"
        " never saw |",
        f"| time | {seconds:.3f} s of one core for 20 objects |", "",
    ]  # fmt: skip
    for view, words in VIEWS.items():
        lines += _table(result["views"][view], words)
    if JOINT.is_file():
        after = json.loads(JOINT.read_text())
        lines += _third_step(result, after, after["training"])
    if ablation.FILE.is_file():
        lines += _without_features(json.loads(ablation.FILE.read_text()))
    return "\n".join([*lines, *LIMITS]) + "\n"


def _table(part: Mapping, words: str) -> list[str]:
    boxes = ("ap_15", "ap_25", "ap_50", "released_ap_15", "paper_colliding_pairs",
             "paper_hitting_wall")  # fmt: skip
    lines = [
        f"## {words}: {part['objects']} objects, estimated layouts", "",
        "| | AP@0.15 | AP@0.25 | AP@0.5 | AP@0.15 as released | collisions | in walls |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    lines += [
        f"| {ROWS[name]} | {' | '.join(f'{row[key]:.3f}' for key in boxes)} |"
        for name, row in part["rows"].items()
    ]
    lines += ["", "| relation | rule on the pose network's boxes | context network |"]
    lines += ["| --- | --- | --- |"]
    for key, what in RELATIONS.items():
        cells = [_cell(part["rows"][row].get(key), key) for row in ("pose", "context")]
        lines.append(f"| {what} | {' | '.join(cells)} |")
    return [*lines, ""]


def _third_step(before: Mapping, after: Mapping, training: Mapping) -> list[str]:
    """Return what the training through the arrangement made of the networks it began from."""
    scores = ("ap_15", "ap_25", "ap_50")
    lines = [
        "## The third step", "",
        f"Step `joint`, {training['steps']} steps of {training['batch_size']} scenes, trains both"
        " networks on through the",
        "unrolled arrangement; the checkpoint with the best `selection` is that after"
        f" {training['best_step']}. The",
        "gradients of the losses behind the arrangement are"
        f" {training['gradient_context']:.1f} long in this network and"
        f" {training['gradient_pose']:.1f} in the",
        f"pose network. Published are the weights {'before' if not training['kept'] else 'after'}"
        " it; \"before\" has them, which may have been trained on since.", "",
        "| | AP@0.15 | AP@0.25 | AP@0.5 | touching | touching a wall | on the floor |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    for view, words in VIEWS.items():
        for name, result in (("before", before), ("after", after)):
            rows = result["views"][view]["rows"]
            numbers = [rows["full"][key] for key in scores]
            numbers += [rows["context"][key] for key in tuple(RELATIONS)[:3]]
            cells = " | ".join(f"{number:.3f}" for number in numbers)
            lines.append(f"| {words}, {name} | {cells} |")
    return [*lines, "", "AP of the arranged boxes, F1 of what the network says.", ""]


def _without_features(rows: Mapping[str, Mapping]) -> list[str]:
    """Return what short trainings reach without the features that the paper proposes."""
    one = next(iter(rows.values()))
    return [
        "## Without the proposed features", "",
        f"Trainings of boxes and relations from scratch, {one['steps']} steps of"
        f" {one['batch_size']} scenes and seed {one['seed']} each,",
        f"on homes of version {one.get('homes_version', 1)}: too short to be the best, and one",
        "seed says little about small differences.", "",
        ablation.table(dict(rows)), "",
    ]  # fmt: skip


def _training(run: Path) -> dict[str, float | bool]:
    """Return what is known of a training of step ``joint``."""
    header = read_weights_header(run / "weights.safetensors")
    found = header.metrics
    return {
        "steps": header.recipe["steps"],
        "batch_size": header.recipe["batch_size"],
        "best_step": int(found["step"]),
        "gradient_context": found["arranged_gradient_context"],
        "gradient_pose": found["arranged_gradient_pose"],
        "kept": file_hash(run / "weights.safetensors") == file_hash(shipped_weights("context")),
    }


def _cell(value: float | None, key: str) -> str:
    if value is None:
        return ""
    return f"{value:.0f}°" if key.endswith("deg") else f"{value:.3f}"


LIMITS = (
    "AP is the standard mean over the categories present; of true BFoVs all have the same score.",
    "Collisions are pairs of objects, and objects in walls, per scene; those of the trainings",
    "without features are arranged with the settings of their day. Relations are F1 (yaws:",
    "mean error) between the objects whose BFoV shows a true one, whatever their boxes.",
    "",
    "## Limits",
    "",
    "- The checkpoint was chosen, and the relation probabilities were calibrated, on the part it",
    "  is scored on: expect somewhat less elsewhere.",
    "- It fits the pose weights that it was trained with, and their mean sizes.",
    "- Trained on a few hundred rendered panoramas, with made-up errors. Real photos were not",
    "  seen.",
    "- Contact with the ceiling is too rare in the data to be learnt well.",
    "",
    "## Licence",
    "",
    "Code and weights Apache-2.0.",
)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("estimates", type=Path)
    parser.add_argument("--split", default="val")
    parser.add_argument("--weights", type=Path)
    parser.add_argument("--pose", type=Path)
    parser.add_argument("--joint", type=Path, metavar="RUN_FOLDER")
    given = parser.parse_args()
    try:
        weights = given.weights or shipped_weights("context")
        pose = given.pose or shipped_weights("pose")
    except CheckpointError as error:
        raise SystemExit(str(error)) from None
    if given.joint is not None:
        both = (given.joint / f"{name}.safetensors" for name in ("weights", "pose"))
        result = measure(given.data, given.estimates, "val", *both, encoder=pose)
        result["training"] = _training(given.joint)
        write_atomically(JOINT, json.dumps(result, indent=1) + "\n")
        write_atomically(CARD, card(json.loads(OUTPUT.read_text()), weights))
        return
    result = measure(given.data, given.estimates, given.split, weights, pose)
    output = OUTPUT if given.split == "val" else OUTPUT.with_name(f"context-{given.split}.json")
    write_atomically(output, json.dumps(result, indent=1) + "\n")
    if given.split == "val":
        CARD.parent.mkdir(exist_ok=True)
        write_atomically(CARD, card(result, weights))
    for view, part in result["views"].items():
        print(f"{view}: {json.dumps(part['rows'], indent=1)}")


if __name__ == "__main__":
    main()
