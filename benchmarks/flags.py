"""Measures what tells rooms from other pictures: writes benchmarks/flags.json and prints a table.

    python benchmarks/flags.py DATA [--photos FOLDER]

Rooms are the validation panoramas of DATA, photos any real panoramas of rooms. What is no room is
computed, as no outdoor panoramas are at hand: views as from the windows of rendered homes, a
meadow, the sea, clouds, noise and plain colours. Takes about a second a picture.
"""

import argparse
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image
from torch import Tensor

from panoscene.eval import machine_facts
from panoscene.models.layout import LayoutStage, load_layout_stage
from panoscene.pipeline._flags import (
    LEAST_CORNER,
    LEAST_WALL_DEG,
    WEAK_EMPTY_WALL,
    WEAK_WALL,
    room_signs,
)
from panoscene.scene import write_atomically
from panoscene.synth.dataset import open_dataset
from panoscene.synth.render import sample_light
from panoscene.synth.render._outside import outside_picture

OUTPUT = Path(__file__).with_suffix(".json")
ROWS, COLUMNS = 512, 1024
VIEWS = 24
"""Of the outside."""


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--photos", type=Path, help="folder of real panoramas of rooms")
    parser.add_argument("--output", type=Path, default=OUTPUT)
    choice = parser.parse_args()
    torch.set_num_threads(1)
    stage = load_layout_stage()
    kinds = {"rendered rooms": measured(stage, rendered(choice.data))}
    if choice.photos:
        kinds["photos of rooms"] = measured(stage, photos(choice.photos))
    kinds |= {name: measured(stage, pictures) for name, pictures in painted().items()}
    limits = {"wall_deg": LEAST_WALL_DEG, "corner": LEAST_CORNER, "wall_score": WEAK_WALL}
    limits["wall_score_empty"] = WEAK_EMPTY_WALL
    result = {"set": open_dataset(choice.data).info.name, "limits": limits, "kinds": kinds}
    result["machine"] = machine_facts()
    write_atomically(choice.output, json.dumps(result, indent=2) + "\n")
    print("kind, pictures, flagged, flagged if nothing is found; least to most of each sign")
    for kind, found in kinds.items():
        spans = [f"{k} {v[0]:.2f} to {v[1]:.2f}" for k, v in found["signs"].items()]
        counts = (found["pictures"], found["flagged"], found["flagged_empty"])
        print(f"{kind}: {', '.join(map(str, counts))}; {', '.join(spans)}")


def measured(stage: LayoutStage, pictures: Iterable[tuple[Tensor, float]]) -> dict[str, Any]:
    """Return the least and largest of each sign, and how many pictures are flagged."""
    found = [
        room_signs(stage(picture, camera_height=height), height) for picture, height in pictures
    ]
    signs = {name: np.array([one[name] for one in found]) for name in found[0]}
    low = (signs["wall_deg"] < LEAST_WALL_DEG) | (signs["corner"] < LEAST_CORNER)
    return {
        "pictures": len(found),
        "flagged": int((low | (signs["wall_score"] < WEAK_WALL)).sum()),
        "flagged_empty": int((low | (signs["wall_score"] < WEAK_EMPTY_WALL)).sum()),
        "signs": {name: [float(all_.min()), float(all_.max())] for name, all_ in signs.items()},
    }


def rendered(root: Path) -> Iterator[tuple[Tensor, float]]:
    """Return the validation panoramas of a set; their cameras stand upright."""
    for item in open_dataset(root, "val"):
        yield item.image(), item.scene().panorama.camera_height


def photos(folder: Path) -> Iterator[tuple[Tensor, float]]:
    """Return the photos of a folder as they are."""
    for file in sorted(folder.glob("*.jpg")):
        with Image.open(file) as picture:
            small = picture.convert("RGB").resize((COLUMNS, ROWS), Image.Resampling.LANCZOS)
        yield torch.from_numpy(np.array(small)).permute(2, 0, 1).float() / 255, 1.6


def painted() -> dict[str, list[tuple[Tensor, float]]]:
    """Return pictures of what is no room, by kind."""
    generator = torch.Generator().manual_seed(0)
    half = (3, ROWS // 2, COLUMNS)
    rough = torch.rand(half, generator=generator)
    sky = torch.linspace(0.4, 0.9, ROWS // 2)[None, :, None].expand(half)
    grass = colour(0.3, 0.45, 0.2) * (0.6 + 0.4 * rough)
    water = colour(0.1, 0.25, 0.4) * (0.9 + 0.1 * rough)
    clouds = torch.nn.functional.interpolate(
        torch.rand(1, 3, 16, 32, generator=generator), (ROWS, COLUMNS), mode="bicubic"
    )[0].clamp(0, 1)
    pictures = {
        "views of the outside": [outside(seed) for seed in range(VIEWS)],
        "meadow": [torch.cat([sky, grass], 1)],
        "sea": [torch.cat([sky, water], 1)],
        "clouds": [0.6 + 0.4 * clouds.mean(0, keepdim=True).expand(3, -1, -1)],
        "noise": [torch.rand(3, ROWS, COLUMNS, generator=generator)],
        "plain colours": [torch.full((3, ROWS, COLUMNS), level) for level in (0.1, 0.5, 0.9)],
    }
    return {kind: [(picture, 1.6) for picture in some] for kind, some in pictures.items()}


def colour(red: float, green: float, blue: float) -> Tensor:
    """Return a colour that fills a picture."""
    return torch.tensor([red, green, blue])[:, None, None]


def outside(seed: int) -> Tensor:
    """Return a garden, street, field or city on a cloudy day, exposed for its middle."""
    light = sample_light(np.random.default_rng(seed), kind="overcast")
    radiance = outside_picture(light, COLUMNS)
    level = np.exp(np.log(radiance.mean(-1) + 1e-6).mean())
    exposed = np.clip(0.35 * radiance / level, 0, 1) ** (1 / 2.2)
    return torch.from_numpy(exposed.astype(np.float32)).permute(2, 0, 1).contiguous()


if __name__ == "__main__":
    main()
