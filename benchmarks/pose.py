"""Scores the pose network with true BFoVs: writes benchmarks/pose.json and its model card.

    python benchmarks/pose.py DATA [--weights FILE] [--records FOLDER]
    python benchmarks/pose.py DATA --split test-seen test-unseen --records FOLDER \
        --output benchmarks/pose-test.json

Without a file the weights that come with the package are scored. Each panorama goes through the
stage as a photo does: turned upright, cropped, with and without the true layout. ``--records`` is
the output of ``panoscene precompute`` for these parts by the weights of the package; with it,
detections and layouts of the networks are scored too. With another part or another file to write,
the model card stays as it is.
"""

import argparse
import json
import statistics
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch

from panoscene.data import StageRecord, read_pose_scenes, read_stage_records
from panoscene.eval import machine_facts
from panoscene.models import CheckpointError, read_weights_header, shipped_weights
from panoscene.models.pose import load_pose_stage
from panoscene.scene import CATEGORIES, Detections, upright_photo, write_atomically
from panoscene.synth.dataset import open_dataset
from panoscene.train._pose_scores import (
    category_scores,
    detection_scores,
    floor_box_objects,
    matched_errors,
    paired_errors,
)
from panoscene.train._precompute import HEADER
from panoscene.train._precompute_estimates import file_hash

ROOT = Path(__file__).resolve().parents[1]
OUTPUT = Path(__file__).with_suffix(".json")
CARD = ROOT / "model_cards" / "pose-compact.md"
ROWS = {
    "true_room": "true layout",
    "no_room": "no layout",
    "no_crops": "true layout, no crops",
    "floor": "baseline: mean size on the floor",
    "found_room": "layout of the network",
    "found": "detections and layout of the networks",
    "found_no_crops": "detections and layout of the networks, no crops",
    "found_floor": "baseline on the same detections",
}
UNPAIRED = ("found", "found_no_crops", "found_floor")
"""Rows whose objects are not those of the truth."""


def read_found(folder: Path) -> dict[str, StageRecord]:
    """Return records of the first stages.

    Raises:
        SystemExit: They are of other weights than those of the package.
    """
    header = json.loads((folder / HEADER).read_text())
    for stage in ("detector", "layout"):
        if header.get(stage) != file_hash(shipped_weights(stage)):
            raise SystemExit(f"{folder}: found records of another {stage} than the shipped one")
    return read_stage_records(folder)


def measure(data: Path, splits: Sequence[str], weights: Path, records: Path | None) -> dict:
    """Return scores of all ways to run the stage, and how long it takes."""
    stage = load_pose_stage(weights=weights)
    found = {} if records is None else read_found(records)
    items = [item for split in splits for item in open_dataset(data, split)]
    scenes = read_pose_scenes(items, found)
    truth = [source.scene for source in scenes]
    objects: dict[str, list] = {name: [] for name in ROWS}
    seconds, processor = [], []
    mean_size = stage.network.mean_size
    for source in scenes:
        scene, height = source.scene, source.scene.panorama.camera_height
        image = upright_photo(source.item.image(), scene.panorama)
        seen = Detections(scene.objects.bfov, scene.objects.category, scene.objects.score)
        start, busy = time.perf_counter(), time.process_time()
        encoded = stage.encoded(image, seen)
        objects["true_room"].append(stage.placed(encoded, seen, scene.layout, height))
        share = 20 / len(seen.category)
        seconds.append(share * (time.perf_counter() - start))
        processor.append(share * (time.process_time() - busy))
        objects["no_room"].append(stage.placed(encoded, seen, None, height))
        blind = torch.zeros_like(encoded)
        objects["no_crops"].append(stage.placed(blind, seen, scene.layout, height))
        objects["floor"].append(floor_box_objects(scene.objects, mean_size, height))
        if source.found is None:
            continue
        room = source.found.layout
        objects["found_room"].append(stage.placed(encoded, seen, room, height))
        seen = source.found.detections
        encoded = stage.encoded(image, seen)
        boxes = stage.placed(encoded, seen, room, height)
        objects["found"].append(boxes)
        blind = torch.zeros_like(encoded)
        objects["found_no_crops"].append(stage.placed(blind, seen, room, height))
        objects["found_floor"].append(floor_box_objects(boxes, mean_size, height))
    rows = {}
    for name, predicted in objects.items():
        if len(predicted) == len(truth):
            rows[name] = detection_scores(predicted, truth)
            errors = matched_errors if name in UNPAIRED else paired_errors
            rows[name] |= errors(predicted, truth)
    area = category_scores(objects["true_room"], truth)[0]
    count = np.bincount(torch.cat([s.objects.category for s in truth]).numpy(), minlength=57)
    return {
        "split": " and ".join(splits),
        "homes_version": open_dataset(data).info.homes_version,
        "panoramas": len(truth),
        "objects": int(count.sum()),
        "rows": rows,
        "categories": {
            CATEGORIES[k]: {"targets": int(count[k]), "ranked_ap_15": float(area[k])}
            for k in np.argsort(-count, kind="stable")
            if count[k]
        },
        "seconds_for_20_objects": statistics.median(seconds),
        "processor_seconds_for_20_objects": statistics.median(processor),
        "machine": machine_facts(),
    }


def card(result: Mapping, weights: Path) -> str:
    """Return the model card."""
    header = read_weights_header(weights)
    recipe, done = header.recipe, int(header.metrics.get("step", 0))
    lines = [
        "# Model card: pose, compact edition", "",
        "<!-- made by benchmarks/pose.py; do not edit -->", "",
        "Turns detections in an upright panorama into boxes: size, place, yaw. See",
        "[docs/pose.md](../docs/pose.md).", "",
        "| | |", "| --- | --- |",
        f"| file | `{weights.name}`, {weights.stat().st_size / 1e6:.1f} MB |",
        f"| network | {header.config['backbone']}, crops of {header.config['crop_px']} px |",
        f"| trained | {done} steps of {recipe.get('batch_size')} scenes, seed {header.seed} |",
        f"| data | rendered panoramas of our own, index hash `{header.data_hash[:16]}` |",
        f"| scored on | {result['panoramas']} panoramas of `{result['split']}`,"
        f" {result['objects']} objects, homes that training never saw |",
        f"| time | {result['processor_seconds_for_20_objects']:.2f} s of one core for 20 objects |",
        "", "## Scores with true BFoVs", "",
        "AP is the standard mean over the categories present. True BFoVs all have the same score,",
        "so objects are ranked by the confidence in their distance; the first column leaves them",
        "tied. Errors are medians over all objects, or over those that a detection shows where",
        "detections are the network's. With the true layout the network knows more",
        "than the baseline, which is given no room; without a layout, or with that of the layout",
        "network, the comparison is fair.", "",
        "| input | tied AP@0.15 | AP@0.15 | AP@0.25 | AP@0.5 | centre | distance | size | yaw"
        " | front for back |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]  # fmt: skip
    for name, words in ROWS.items():
        if name not in result["rows"]:
            continue
        row = result["rows"][name]
        names = ("ap_15", "ranked_ap_15", "ranked_ap_25", "ranked_ap_50")
        cells = [f"{row[name]:.3f}" for name in names]
        cells += (
            [
                f"{row['centre_error_m']:.2f} m", f"{row['distance_error_m']:.2f} m",
                f"{100 * row['size_error']:.0f} %", f"{row['yaw_error_deg']:.0f}°",
                f"{100 * row['front_back']:.0f} %",
            ]
            if "yaw_error_deg" in row
            else [""] * 5
        )  # fmt: skip
        lines.append(f"| {words} | {' | '.join(cells)} |")
    lines += ["", "By category, with the true layout:", "", "| category | objects | AP@0.15 |"]
    lines += ["| --- | --- | --- |"]
    lines += [
        f"| {name.replace('_', ' ')} | {row['targets']} | {row['ranked_ap_15']:.2f} |"
        for name, row in result["categories"].items()
    ]
    lines += ["", *LIMITS]
    return "\n".join(lines) + "\n"


LIMITS = (
    "## Limits",
    "",
    "- Crops add little: sizes and yaws come from BFoVs, categories and the room above all.",
    "- Front for back is taken no less often than by the baseline, for which all objects face the",
    "  camera.",
    "- Thin things (pictures, carpets, clocks, mirrors) rarely reach an IoU of 0.15.",
    "- The checkpoint was chosen on the part it is scored on: expect somewhat less elsewhere.",
    "- The training went on from weights of earlier ones, which are not published: recipe and",
    "  seed alone do not give these weights.",
    "- Trained on a few hundred rendered panoramas, for a few hours of one core. Real photos",
    "  were not seen.",
    "- Lengths scale with the height of the camera: a wrong one scales the room and all in it.",
    "- Sizes are relative to the mean sizes of the training set, stored with the weights.",
    "- Categories with few objects have scores of little meaning.",
    "",
    "## Licence",
    "",
    "Code and weights Apache-2.0. The encoder starts from the ImageNet weights of",
    "EfficientNet-Lite0.",
)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--split", nargs="+", default=["val"], help="parts of the set")
    parser.add_argument("--output", type=Path, default=OUTPUT)
    parser.add_argument("--weights", type=Path)
    parser.add_argument("--records", type=Path)
    given = parser.parse_args()
    try:
        weights = given.weights or shipped_weights("pose")
    except CheckpointError as error:
        raise SystemExit(str(error)) from None
    torch.set_num_threads(2)
    result = measure(given.data, given.split, weights, given.records)
    write_atomically(given.output, json.dumps(result, indent=1) + "\n")
    if (given.split, given.output) == (["val"], OUTPUT):
        CARD.parent.mkdir(exist_ok=True)
        write_atomically(CARD, card(result, weights))
    print(json.dumps(result["rows"], indent=1))


if __name__ == "__main__":
    main()
