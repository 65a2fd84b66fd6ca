"""Measures how exactly tilted panoramas are made upright, and writes benchmarks/upright.json.

    python benchmarks/upright.py /work/pilot
    python benchmarks/upright.py /work/pilot --splits val --count 25 --output /tmp/upright.json

Each panorama is measured three times: as it was rendered, by a camera with a known tilt of 0 to 5
degrees; turned by a random tilt of 0 to 30 degrees; and that disturbed as in training (exposure,
tone, blur, noise, stitching seams, tripod, JPEG). The error is the angle between the true and the
estimated vertical.
"""

import argparse
import json
import math
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float64
from torch import Tensor

from panoscene.data import augment_photo
from panoscene.eval import machine_facts
from panoscene.geometry import rotate_panorama
from panoscene.models.upright import LEAST_CONFIDENCE, upright_rotation
from panoscene.scene import write_atomically
from panoscene.synth.dataset import PanoramaItem, open_dataset

OUTPUT = Path(__file__).with_suffix(".json")
MOST_TILT = 30
BIN = 5
FAILED = 2.0
"""Degrees of error from which on an estimate counts as a failure."""


def main() -> None:
    """Measure the parts of a set and write the file."""
    parser = argparse.ArgumentParser(description="Measures how exactly panoramas are made upright.")
    parser.add_argument("data", type=Path, help="folder of a rendered set")
    parser.add_argument("--splits", nargs="+", default=["train", "val"])
    parser.add_argument("--count", type=int, default=100, help="panoramas of each part, at most")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--output", type=Path, default=OUTPUT)
    options = parser.parse_args()
    torch.set_num_threads(1)
    result = {
        "splits": {
            split: measure(options.data, split, options.count, options.seed)
            for split in options.splits
        },
        "failed_from_deg": FAILED,
        "least_confidence": LEAST_CONFIDENCE,
        "seed": options.seed,
        "set": open_dataset(options.data).info.name,
        "machine": machine_facts(),
    }
    write_atomically(options.output, json.dumps(result, indent=2) + "\n")


def measure(data: Path, split: str, count: int, seed: int) -> dict[str, object]:
    """Return the errors of one part of a set."""
    rng = np.random.default_rng(seed)
    items = open_dataset(data, split)
    chosen = rng.permutation(len(items))[:count]
    rows: dict[str, list[tuple[float, ...]]] = {
        "rendered": [],
        "turned": [],
        "disturbed": [],
    }
    seconds = []
    for index in chosen:
        for kind, image, rotation in photos(items[int(index)], rng):
            start = time.process_time()
            estimate = upright_rotation(image)
            seconds.append(time.process_time() - start)
            tilt = math.degrees(math.acos(min(1.0, float(rotation[2, 2]))))
            error = apart(rotation[2], estimate.rotation[2])
            rows[kind].append((tilt, error, estimate.confidence))
    kinds = {kind: summary(np.array(found)) for kind, found in rows.items()}
    for kind, numbers in kinds.items():
        print(f"{split}, {kind}: {numbers['all']}", flush=True)
    return {"panoramas": len(chosen), "median_cpu_s": float(np.median(seconds)), **kinds}


def photos(
    item: PanoramaItem, rng: np.random.Generator
) -> Iterator[tuple[str, Tensor, Float64[Tensor, "3 3"]]]:
    """Give the panorama as it is, tilted, and disturbed; each with its true rotation."""
    image = item.image()
    upright = torch.tensor(item.scene().panorama.upright_from_photo, dtype=torch.float64)
    left, _, right = torch.linalg.svd(upright)
    upright = left @ right
    yield "rendered", image, upright
    tilt, lean = math.radians(rng.uniform(0, MOST_TILT)), rng.uniform(-math.pi, math.pi)
    turn = tilted(tilt, lean)
    turned = rotate_panorama(image, turn)
    yield "turned", turned, upright @ turn.T
    generator = torch.Generator().manual_seed(int(rng.integers(2**31)))
    yield "disturbed", augment_photo(turned, generator), upright @ turn.T


def tilted(tilt: float, lean: float) -> Float64[Tensor, "3 3"]:
    """Return a turn by an angle about a level axis."""
    x, y = math.cos(lean), math.sin(lean)
    axis = torch.tensor([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]], dtype=torch.float64)
    return torch.linalg.matrix_exp(tilt * axis)


def apart(first: Tensor, second: Tensor) -> float:
    """Return the angle between unit vectors in degrees."""
    return math.degrees(
        math.atan2(float(torch.linalg.cross(first, second).norm()), float(first @ second))
    )


def summary(rows: Float64[np.ndarray, "n 3"]) -> dict[str, object]:
    """Return the errors of all, and of the panoramas of each tilt."""
    tilt = rows[:, 0]
    edges = range(0, int(tilt.max()) + 1, BIN)
    bins = {f"{low}-{low + BIN}": rows[(tilt >= low) & (tilt < low + BIN)] for low in edges}
    return {
        "all": numbers(rows),
        "by_tilt_deg": {name: numbers(some) for name, some in bins.items() if len(some)},
    }


def numbers(rows: Float64[np.ndarray, "n 3"]) -> dict[str, float | int]:
    """Return how far off the vertical is."""
    error, confidence = rows[:, 1], rows[:, 2]
    quantiles: Sequence[float] = np.quantile(error, (0.5, 0.9, 1.0)).round(4).tolist()
    return {
        "count": len(rows),
        "median_deg": quantiles[0],
        "p90_deg": quantiles[1],
        "worst_deg": quantiles[2],
        "failed_share": float((error > FAILED).mean()),
        "unsure_share": float((confidence < LEAST_CONFIDENCE).mean()),
        "least_confidence": round(float(confidence.min()), 4),
    }


if __name__ == "__main__":
    main()
