"""Measures how far detector and layout turn with the panorama: writes benchmarks/rolls.json.

    python benchmarks/rolls.py DATA [--split val] [--count 10] [--angles 90 45 5.6 13 51]

A panorama is rolled by whole columns, read, and what is found is turned back. Were the networks
blind to where the seam is, that would be what the panorama gives as it is. About a second of
processor time for each panorama and angle.
"""

import argparse
import json
import math
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.eval import machine_facts
from panoscene.geometry import bfov_iou, layout_iou_3d, wrap_angle
from panoscene.models import shipped_weights
from panoscene.models.detector import load_detector_stage
from panoscene.models.layout import load_layout_stage
from panoscene.scene import Detections, Layout, upright_photo, write_atomically
from panoscene.synth.dataset import PanoramaItem, open_dataset
from panoscene.train._precompute_estimates import file_hash

OUTPUT = Path(__file__).with_suffix(".json")
STRIDES = {"detector": 64, "layout": 32}
"""Pixels of the network's picture between two places of its coarsest level."""
SURE = 0.5
"""Score from which on a detection should be found again."""
OVERLAPS = (0.5, 0.9)
"""Overlaps of BFoVs above which two detections are the same."""


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, help="folder of a rendered set")
    parser.add_argument("--split", default="val", help="part of the set")
    parser.add_argument("--count", type=int, default=10, help="panoramas, evenly from the part")
    parser.add_argument("--angles", type=float, nargs="+", default=[90, 45, 5.6, 13, 51])
    parser.add_argument("--output", type=Path, default=OUTPUT)
    choice = parser.parse_args()
    torch.set_num_threads(1)
    start = time.process_time()
    data = open_dataset(choice.data, choice.split)
    items = data[:: max(1, len(data) // choice.count)][: choice.count]
    result = {
        "angles": measured(items, choice.angles),
        "panoramas": len(items),
        "part": choice.split,
        "homes_version": data.info.homes_version,
        "sure": SURE,
        "weights": {name: file_hash(shipped_weights(name)) for name in STRIDES},
        "processor_s": time.process_time() - start,
        "machine": machine_facts(),
    }
    write_atomically(choice.output, json.dumps(result, indent=2) + "\n")
    for row in result["angles"]:
        print(json.dumps(row))


def measured(items: Sequence[PanoramaItem], angles: Sequence[float]) -> list[dict[str, Any]]:
    """Return for each angle what is found again, a row each.

    Args:
        items: Panoramas of a set.
        angles: Degrees, to be rounded to whole columns.
    """
    detector, layout = load_detector_stage(), load_layout_stage()
    widths = {
        "detector": detector.network.config.width,
        "layout": layout.network.config.image_width,
    }
    best: list[list[Tensor]] = [[] for _ in angles]
    rooms: list[list[tuple[float, bool]]] = [[] for _ in angles]
    turns: list[float] = [0.0] * len(angles)
    for item in items:
        panorama = item.scene().panorama
        image, height = upright_photo(item.image(), panorama), panorama.camera_height
        seen, room = detector(image), layout(image, camera_height=height).layout
        for k, angle in enumerate(angles):
            columns = round(image.shape[-1] * angle / 360)
            turns[k] = columns / image.shape[-1]
            rolled = image.roll(columns, -1)
            best[k].append(overlaps(seen, detector(rolled), 2 * math.pi * turns[k]))
            found = layout(rolled, camera_height=height).layout
            same = len(found.floor_polygon) == len(room.floor_polygon)
            rooms[k].append((agreement(room, found, 2 * math.pi * turns[k]), same))
    rows = []
    for turn, overlap, pairs in zip(turns, best, rooms, strict=True):
        every = torch.cat(overlap)
        iou = [value for value, _ in pairs]
        pixels = {name: turn * width for name, width in widths.items()}
        rows.append({
            "angle_deg": 360 * turn,
            "pixels": pixels,
            "whole_strides": {name: pixels[name] % STRIDES[name] == 0 for name in STRIDES},
            "sure_detections": len(every),
            "found_again": {f"{o:g}": int((every > o).sum()) for o in OVERLAPS},
            "layout_iou_3d": sum(iou) / len(iou),
            "layout_iou_3d_least": min(iou),
            "layout_same_corners": sum(same for _, same in pairs),
        })  # fmt: skip
    return rows


def overlaps(seen: Detections, again: Detections, turn: float) -> Float[Tensor, " sure"]:
    """Return the largest overlap of each sure detection with one of its category.

    Args:
        seen: In the panorama as it is.
        again: In the rolled one, with any score.
        turn: By how much it was rolled to the right, in radians.
    """
    sure = seen.score >= SURE
    back = again.bfov.clone()
    back[:, 0] = wrap_angle(back[:, 0] - turn)
    iou = bfov_iou(seen.bfov[sure], back)
    iou = torch.where(seen.category[sure][:, None] == again.category, iou, 0.0)
    return torch.cat((iou, torch.zeros(len(iou), 1)), 1).amax(1)


def agreement(room: Layout, found: Layout, turn: float) -> float:
    """Return the 3D IoU of a room and that of the rolled panorama, turned back.

    Args:
        room: Of the panorama as it is.
        found: Of the rolled one.
        turn: By how much it was rolled to the right, in radians; longitudes run clockwise from
            above, so the room turns counter-clockwise to get back.
    """
    cos, sin = math.cos(turn), math.sin(turn)
    back = found.floor_polygon.double() @ torch.tensor([[cos, sin], [-sin, cos]]).double()
    heights = [(one.floor_height, one.ceiling_height) for one in (room, found)]
    return layout_iou_3d(room.floor_polygon.double(), heights[0], back, heights[1])


if __name__ == "__main__":
    main()
