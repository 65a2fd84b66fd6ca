"""Reads what trainings without some features reached: writes benchmarks/ablation.json.

    python benchmarks/ablation.py NAME=RUN_FOLDER [NAME=RUN_FOLDER ...]

The runs are trainings of the context stage that differ in one option each, with as many steps and
the same seed. ``context.py`` puts their scores into the model card.
"""

import argparse
import json
from pathlib import Path

from panoscene.models import read_weights_header
from panoscene.scene import write_atomically
from panoscene.synth.dataset import open_dataset

FILE = Path(__file__).with_suffix(".json")
SCORES = {
    "touching_f1": "touching",
    "touching_wall_f1": "touching a wall",
    "on_floor_f1": "on the floor",
    "relative_yaw_error_deg": "yaw between objects",
    "relative_yaw_wall_error_deg": "yaw to walls",
    "ranked_ap_15": "AP@0.15",
    "arranged_paper_colliding_pairs": "collisions, arranged",
}
"""What is kept of the validation with true BFoVs, and of that with detections (``found_``)."""


def main() -> None:
    """Read the runs and write."""
    parser = argparse.ArgumentParser()
    parser.add_argument("runs", nargs="+", metavar="NAME=RUN_FOLDER")
    rows = {}
    for pair in parser.parse_args().runs:
        name, equals, folder = pair.partition("=")
        if not (name and equals and folder):
            parser.error(f"found {pair}, expected NAME=RUN_FOLDER")
        header = read_weights_header(Path(folder) / "weights.safetensors")
        rows[name] = {
            "steps": int(header.metrics["step"]),
            "batch_size": header.recipe["batch_size"],
            "seed": header.seed,
            "homes_version": open_dataset(Path(header.recipe["data"])).info.homes_version,
        } | {
            view + score: header.metrics[view + score]
            for view in ("", "found_")
            for score in SCORES
        }
    lengths = {(row["steps"], row["batch_size"], row["seed"]) for row in rows.values()}
    if len(lengths) > 1:
        parser.error(f"steps, batch_size and seed: found {sorted(lengths)}, expected the same")
    write_atomically(FILE, json.dumps(rows, indent=1) + "\n")


def table(rows: dict[str, dict[str, float]]) -> str:
    """Return the scores of each row, with true BFoVs and with detections."""
    lines = [f"| | {' | '.join(SCORES.values())} |", "| --- " * (len(SCORES) + 1) + "|"]
    for view, words in (("", "true BFoVs"), ("found_", "detections")):
        for name, row in rows.items():
            cells = [
                f"{row[view + score]:.1f}°" if score.endswith("deg") else f"{row[view + score]:.3f}"
                for score in SCORES
            ]
            lines.append(f"| {words}, {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
