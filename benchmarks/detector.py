"""Measures the detector on the part val of a set, with each way to see the seam.

    python benchmarks/detector.py /work/pilot --weights runs/detector/weights.safetensors
    python benchmarks/detector.py /work/pilot --seams --photos photos --pictures pictures
    python benchmarks/detector.py /work/pilot --seams --card model_cards/detector-compact.md
    python benchmarks/detector.py /work/pilot --split test-seen test-unseen --seams circular \
        --output benchmarks/detector-test.json

Writes benchmarks/detector.json: COCO's AP of masks and boxes, recall of BFoVs (both also of each
category), recall of the objects across the seam, seconds. The weights are the same for all ways;
they were trained with the first one, so this does not compare trainings. Pictures of photos and of
panoramas of the set go to a folder. The card is written from that file.
"""

import argparse
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np
import torch
from PIL import Image

from panoscene.data._detector_truth import seen_objects
from panoscene.eval import machine_facts
from panoscene.models import read_weights_header, shipped_weights
from panoscene.models.detector import (
    DetectorStage,
    Seam,
    build_detector,
    load_detector_stage,
)
from panoscene.scene import Detections, read_panorama, upright_photo, write_atomically
from panoscene.synth.dataset import PanoramaItem, open_dataset
from panoscene.train._detector_card import detector_card
from panoscene.train._detector_eval import evaluate_detector
from panoscene.train._detector_pictures import detector_picture
from panoscene.train._precompute_estimates import file_hash

OUTPUT = Path(__file__).with_suffix(".json")
DOUBTFUL = 0.02
"""Scores from which on detections are scored: AP wants the doubtful ones, too."""


def main() -> None:
    """Measure and write the file and the pictures."""
    parser = argparse.ArgumentParser(description="Measures the detector.")
    parser.add_argument("data", type=Path, help="folder of a rendered set")
    parser.add_argument("--weights", type=Path, default=None)
    parser.add_argument("--split", nargs="+", default=["val"], help="parts of the set")
    parser.add_argument("--count", type=int, default=None, help="panoramas, at most")
    parser.add_argument("--seams", nargs="*", choices=get_args(Seam), default=list(get_args(Seam)))
    parser.add_argument("--roll", type=float, default=0.0, help="part of a turn")
    parser.add_argument("--photos", type=Path, default=None, help="folder of panoramas")
    parser.add_argument("--pictures", type=Path, default=None, help="folder for pictures")
    parser.add_argument("--card", type=Path, default=None, help="model card to write")
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    torch.set_num_threads(1)
    items = [x for split in options.split for x in open_dataset(options.data, split)]
    items = items[: options.count]
    weights = options.weights or shipped_weights("detector")
    if options.pictures:
        draw(weights, items, options.photos, options.pictures)
    if options.seams and items:
        measure(options, weights, items)
    if options.card:
        write_card(options.card, weights, json.loads(options.output.read_text()), options.data)


def measure(options: argparse.Namespace, weights: Path, items: Sequence[PanoramaItem]) -> None:
    """Write the scores of each way to see the seam and print the most important ones."""
    result = {
        "scores": {
            seam: evaluate_detector(stage_of(weights, seam), items, roll=options.roll)
            for seam in options.seams
        },
        "split": " and ".join(options.split),
        "panoramas": len(items),
        "roll": options.roll,
        "set": open_dataset(options.data).info.name,
        "homes_version": open_dataset(options.data).info.homes_version,
        "weights": file_hash(weights),
        "machine": machine_facts(),
    }
    write_atomically(options.output, json.dumps(result, indent=2) + "\n")
    for seam, scores in result["scores"].items():
        shown = {k: round(v, 3) for k, v in scores.items() if "/" not in k}
        print(seam, shown, flush=True)


def write_card(card: Path, weights: Path, measured: dict[str, Any], data: Path) -> None:
    """Write the model card from scores on the part val, with the seam as it was trained."""
    header = read_weights_header(weights)
    wanted = ("val", file_hash(weights))
    if (measured["split"], measured.get("weights")) != wanted:
        raise SystemExit("the scores are of another part or of other weights: measure val first")
    scores = measured["scores"][header.config["seam"]]
    count = len(open_dataset(data, "train"))
    write_atomically(card, detector_card(scores, header.recipe, panoramas=count))


def stage_of(weights: Path, seam: Seam) -> DetectorStage:
    """Return a stage that sees the seam in a way, with weights that were trained for another."""
    stage = load_detector_stage(weights=weights, score_threshold=DOUBTFUL)
    if seam == stage.network.config.seam:
        return stage
    network = build_detector(stage.network.config.model_copy(update={"seam": seam}))
    network.load_state_dict(stage.network.state_dict())
    return DetectorStage(network, score_threshold=DOUBTFUL)


def draw(weights: Path, items: Sequence[PanoramaItem], photos: Path | None, output: Path) -> None:
    """Write pictures of six panoramas of the set, above the truth, and of all photos."""
    output.mkdir(parents=True, exist_ok=True)
    stage = load_detector_stage(weights=weights)
    for item in items[:: max(1, len(items) // 6)][:6]:
        image = upright_photo(item.image(), item.scene().panorama)
        seen = seen_objects(item)
        keep = ~seen.ignored
        ones = torch.ones(int(keep.sum()))
        truth = Detections(seen.bfov[keep], seen.category[keep], ones, seen.mask[keep])
        save(detector_picture(image, stage(image), truth), output / f"{item.name}.png")
    for file in sorted(photos.glob("*.jpg")) if photos else ():
        image = small_photo(file)
        save(detector_picture(image, stage(image)), output / f"{file.stem}.png")


def small_photo(file: Path) -> torch.Tensor:
    """Return a photo at 1024 x 512 pixels, RGB in [0, 1]."""
    photo, _ = read_panorama(file)
    small = torch.nn.functional.interpolate(
        photo[None], (512, 1024), mode="bilinear", antialias=True
    )
    return small[0].clamp(0.0, 1.0)


def save(picture: np.ndarray, file: Path) -> None:
    """Write a picture of bytes as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "PNG")
    write_atomically(file, buffer.getvalue())


if __name__ == "__main__":
    main()
