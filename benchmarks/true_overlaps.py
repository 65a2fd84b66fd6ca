"""Which true boxes overlap: ``python benchmarks/true_overlaps.py DATA [SPLIT]``.

Prints, for the panoramas of a data set, each pair of categories of which boxes overlap by more than
0.1 m (the paper's limit): how often, of how many that are nearer than that, and how far; then the
largest 3D IoU of two boxes of one category, and of any.
"""

import sys
from collections import Counter, defaultdict
from pathlib import Path

import torch

from panoscene.geometry import paired_box_iou, separation_margins
from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import open_dataset

LIMIT = 0.1


def main(data: Path, split: str) -> None:
    """Print the table of a part of a data set."""
    near: Counter[tuple[str, str]] = Counter()
    depth: dict[tuple[str, str], list[float]] = defaultdict(list)
    panoramas, same, most = 0, 0.0, 0.0
    for item in open_dataset(data, split):
        objects = item.scene().objects
        panoramas += 1
        first, second = torch.triu_indices(len(objects.boxes), len(objects.boxes), 1)
        iou = paired_box_iou(objects.boxes[first], objects.boxes[second])
        alike = objects.category[first] == objects.category[second]
        same = max([same, *iou[alike].tolist()])
        most = max([most, *iou.tolist()])
        margin = separation_margins(objects.boxes[first], objects.boxes[second]).amin(-1)
        for k in (margin > -LIMIT).nonzero()[:, 0].tolist():
            names = sorted(CATEGORIES[objects.category[index[k]]] for index in (first, second))
            pair = names[0], names[1]
            near[pair] += 1
            if margin[k] > LIMIT:
                depth[pair].append(float(margin[k]))
    count = sum(map(len, depth.values()))
    print(f"{count} pairs of {panoramas} panoramas overlap by more than {LIMIT} m")
    for pair in sorted(depth, key=lambda pair: -len(depth[pair])):
        median = float(torch.tensor(depth[pair]).median())
        print(f"{' and '.join(pair)}: {len(depth[pair])} of {near[pair]}, median {median:.2f} m")
    print(f"largest IoU: {same:.2f} in one category, {most:.2f} in any")


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2] if len(sys.argv) > 2 else "train")
