"""Measures the layout stage on the validation part: writes benchmarks/layout.json and a model card.

    python benchmarks/layout.py DATA [--weights FILE]
    python benchmarks/layout.py DATA --split test-seen test-unseen --output layout-test.json

With another part or another file to write, the model card stays as it is.
Rows: the stage as shipped, its drawn (raw) polygons, true boundaries read back, true boundaries
with noise like a network's, and a square room of usual size that looks at no picture.
"""

import argparse
import json
import math
import time
from collections.abc import Callable
from pathlib import Path

import torch
from torch import Tensor

from panoscene.data import LayoutSamples, layout_targets, room_view
from panoscene.eval import LayoutRecord, layout_record, machine_facts
from panoscene.models import read_weights_header, shipped_weights
from panoscene.models.layout import LayoutPrediction, load_layout_stage, room_from_signals
from panoscene.scene import Scene, write_atomically
from panoscene.synth.dataset import open_dataset
from panoscene.train._layout import layout_scores, scene_of

NOISE_DEG = 1.0
SAME = 1e-4
"""Difference of IoU that rounding makes."""
GROUPS = ("", "_4", "_6", "_8", "_10+")
MEASURES = ("iou_2d", "iou_3d", "corner_error", "pixel_error")
ROOT = Path(__file__).parents[1]
OUTPUT = Path(__file__).with_suffix(".json")
CARD = ROOT / "model_cards" / "layout-compact.md"

Signals = tuple[Tensor, Tensor]


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--weights", type=Path, default=None)
    parser.add_argument("--split", nargs="+", default=["val"], help="parts of the set")
    parser.add_argument("--output", type=Path, default=OUTPUT)
    choice = parser.parse_args()
    torch.set_num_threads(1)
    weights = choice.weights or shipped_weights("layout")
    stage = load_layout_stage("compact", weights)
    items = [item for split in choice.split for item in open_dataset(choice.data, split)]
    size = (stage.network.config.image_height, stage.network.config.image_width)
    samples = LayoutSamples(items, size, cached=0)
    truths = [item.scene() for item in items]
    seconds: list[float] = []

    def predicted(index: int) -> LayoutPrediction:
        image = samples.items[index].image() if _upright(truths[index]) else samples.photo(index)
        start = time.process_time()
        found = stage(image, camera_height=truths[index].panorama.camera_height)
        seconds.append(time.process_time() - start)
        return found

    rows = {
        "network": _scores(predicted, truths),
        "true boundaries": _scores(lambda k: _read(*_true(truths[k]), truths[k]), truths),
        f"true boundaries, {NOISE_DEG:g} degree of noise": _scores(
            lambda k: _read(*_noisy(*_true(truths[k]), seed=k), truths[k]), truths
        ),
        "square room": _scores(lambda k: _read(*_square(), truths[k]), truths),
    }
    seconds.sort()
    header = read_weights_header(weights)
    result = {
        "machine": machine_facts(),
        "part": " and ".join(choice.split),
        "homes_version": open_dataset(choice.data).info.homes_version,
        "panoramas": len(items),
        "seconds_one_thread": seconds[len(seconds) // 2],
        "megabytes": weights.stat().st_size / 1e6,
        "parameters": sum(p.numel() for p in stage.network.parameters()),
        "recipe": header.recipe,
        "step": header.metrics.get("step"),
        "data_hash": header.data_hash,
        "rows": rows,
    }
    write_atomically(choice.output, json.dumps(result, indent=2) + "\n")
    if (choice.split, choice.output) == (["val"], OUTPUT):
        CARD.parent.mkdir(exist_ok=True)
        write_atomically(CARD, card(result))
    print(card(result))


def _upright(scene: Scene) -> bool:
    return torch.equal(torch.tensor(scene.panorama.upright_from_photo), torch.eye(3))


def _scores(predict: Callable[[int], LayoutPrediction], truths: list[Scene]) -> dict[str, float]:
    """Return mean scores, and in which share of the rooms something is so.

    ``same_corners``: the number of corners is right; ``ambiguous``: there are two readings;
    ``worse``: the 2D IoU of the floor polygon is below that of the drawn one, by ``most_worse`` at
    most. ``iou_3d_ambiguous`` and ``iou_3d_clear`` are means over the rooms with and without two
    readings, where there are some.
    """
    records: list[LayoutRecord] = []
    same, torn, loss = 0, [], []
    for index, truth in enumerate(truths):
        found = predict(index)
        record = layout_record(scene_of(found, truth), truth)
        records.append(record)
        same += len(found.layout.floor_polygon) == len(truth.layout.floor_polygon)
        torn.append(found.ambiguous)
        if record.raw is not None:
            loss.append(record.raw.errors.iou_2d - record.regularised.errors.iou_2d)
    iou = [record.regularised.errors.iou_3d for record in records]
    parts = {}
    for name, wanted in (("iou_3d_ambiguous", True), ("iou_3d_clear", False)):
        some = [value for value, one in zip(iou, torn, strict=True) if one == wanted]
        parts |= {name: sum(some) / len(some)} if some else {}
    return (
        layout_scores(records)
        | parts
        | {
            "same_corners": same / len(truths),
            "ambiguous": sum(torn) / len(truths),
            "worse": sum(value > SAME for value in loss) / len(truths),
            "most_worse": max([0.0, *loss]),
        }
    )


def _true(scene: Scene) -> Signals:
    return layout_targets(room_view(scene))


def _square() -> Signals:
    lon = (torch.arange(1024) + 0.5) / 1024 * 2 * math.pi
    # a square with walls 2.2 camera heights away
    nearness = torch.maximum(lon.sin().abs(), lon.cos().abs()) / 2.2
    return torch.stack((torch.atan(0.65 * nearness), -torch.atan(nearness))), torch.zeros(1024)


def _noisy(boundary: Tensor, corner: Tensor, seed: int) -> Signals:
    """Return boundaries with rounded corners and errors that go together over many columns."""
    generator = torch.Generator().manual_seed(seed)
    error = torch.zeros_like(boundary)
    for width, share in ((60, 0.8), (15, 0.5), (3, 0.3)):
        wave = _smooth(torch.randn(2, 1024, generator=generator), width)
        error += share * wave / wave.std()
    weak = 0.5 + 0.5 * float(torch.rand((), generator=generator))
    rounded = _smooth(boundary, 6) + error * math.radians(NOISE_DEG)
    return rounded, _smooth(weak * corner[None], 4)[0]


def _smooth(rows: Tensor, width: int) -> Tensor:
    reach = torch.arange(-3 * width, 3 * width + 1)
    kernel = torch.exp(-0.5 * (reach / width) ** 2)
    around = torch.cat((rows[:, -3 * width :], rows, rows[:, : 3 * width]), dim=1)
    return torch.nn.functional.conv1d(around[:, None], (kernel / kernel.sum())[None, None])[:, 0]


def _read(boundary: Tensor, corner: Tensor, truth: Scene) -> LayoutPrediction:
    reading = room_from_signals(boundary, corner, truth.panorama.camera_height)
    return LayoutPrediction(reading.layout, reading.ambiguous, boundary, corner)


def card(result: dict) -> str:
    """Return the model card of a measurement."""
    recipe = result["recipe"]
    lines = [
        "# layout-compact",
        "",
        "Made by `python benchmarks/layout.py DATA`; do not edit.",
        "",
        "HorizonNet's idea on tf_efficientnet_lite0: a panorama of 128 x 256 pixels in, the "
        "latitudes of the ceiling and floor boundary and the evidence of a corner in 1024 columns "
        "out, read as a Manhattan room.",
        "",
        "| fact | |",
        "| --- | --- |",
        f"| parameters | {result['parameters'] / 1e6:.2f} million |",
        f"| file | {result['megabytes']:.1f} MB, 16 bits |",
        f"| processor time a panorama (1024 x 512, one thread) | {result['seconds_one_thread']:.2f} s |",  # noqa: E501
        f"| training | {result['step']:.0f} steps of {recipe['batch_size']} panoramas, "
        f"seed {recipe['seed']}, start from earlier weights: {bool(recipe.get('start'))} |",
        f"| data | the train part, hash {result['data_hash'][:12]} |",
        f"| measured on | {result['panoramas']} panoramas of the {result['part']} part |",
        "",
        "## Scores",
        "",
        "The camera height is the true one. IoU in [0, 1], errors in percent.",
        "",
        "| reading | corners | rooms | 2D IoU | 3D IoU | corner error | pixel error |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, scores in result["rows"].items():
        for prefix, words in (("", name), ("raw_", f"{name}, as drawn")):
            for group in GROUPS:
                if f"scenes{group}" not in scores:
                    continue
                if group and name != "network":
                    continue
                values = [scores[f"{prefix}{measure}{group}"] for measure in MEASURES]
                numbers = " | ".join(
                    f"{value:.3f}" if k < 2 else f"{value:.2f}" for k, value in enumerate(values)
                )
                rooms = f"{scores[f'scenes{group}']:.0f}"
                lines.append(f"| {words} | {group[1:] or 'all'} | {rooms} | {numbers} |")
    found = result["rows"]["network"]
    worse = f"{100 * found['worse']:.0f} % of the rooms, by at most {found['most_worse']:.3f}"
    lines += ["", "The regular polygon is better than the drawn one on average, and worse in "
        f"{worse} in 2D IoU. `ambiguous` is set in {100 * found['ambiguous']:.0f} % of them."
    ]  # fmt: skip
    right = {name: scores["same_corners"] for name, scores in result["rows"].items()}
    lines += ["", "The number of corners is right in " + ", ".join(
        f"{100 * share:.0f} % ({name})" for name, share in right.items()
    ) + " of the rooms.", "", "## Limits", "",
        "- Trained on rendered rooms only, for minutes: a start, not the last word.",
        "- The checkpoint, the prices of corners, the usual misfit and the smoothing were chosen "
        "on the same validation part: expect somewhat less elsewhere.",
        "- The training was stopped, changed and resumed by hand: recipe and seed alone do not "
        "give these weights.",
        "- The picture is small: walls beyond 8 m and steps below 20 cm are not resolved.",
        "- Read as Manhattan rooms where that fits; round and oblique walls stay as drawn.",
        "- Size comes from the camera height alone.",
        "",
    ]  # fmt: skip
    return "\n".join(lines)


if __name__ == "__main__":
    main()
