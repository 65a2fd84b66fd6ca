"""Pictures of predictions beside the truth: ten test panoramas and the worst five.

    python benchmarks/results_pictures.py DATA RUN

RUN is what ``panoscene eval reconstruct DATA -o RUN`` wrote. Panoramas are ranked by the mean of
the layout's 3D IoU and the F1 of objects at an oriented 3D IoU of 0.15; the ten are spread evenly
over the ranking, so they show the good, the usual and the bad. The second of them is shown from
every side, too. Pictures go into docs/images/results, what is known of each into panoramas.json
there.
"""

import argparse
import json
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path

import torch
from PIL import Image

from panoscene.eval import PREDICTIONS, TARGETS, layout_record, match_objects
from panoscene.scene import Scene, read_scene, upright_photo, write_atomically
from panoscene.synth.dataset import PanoramaItem, open_dataset
from panoscene.views import (
    SheetRow,
    default_view,
    draw_birds_eye,
    draw_overlay,
    draw_sheet,
    render_panorama,
    render_view,
)

OUTPUT = Path(__file__).resolve().parents[1] / "docs" / "images" / "results"
ROW = "full"
TEN, WORST = 10, 5
SPLITS = ("test-seen", "test-unseen")
HEIGHT, SHEET_HEIGHT = 300, 850
FORGIVEN = 0.1
"""Metres of overlap that are not marked, as `panoscene reconstruct` does."""
LARGEST = 250_000
"""Bytes that one committed file may have."""


@dataclass(frozen=True, slots=True)
class Ranked:
    """How well a panorama was understood."""

    name: str
    split: str
    layout_iou: float
    corners: tuple[int, int]
    """Predicted and true."""
    objects: tuple[int, int, int]
    """Predicted, true, and matched at an oriented 3D IoU of 0.15."""
    f1: float

    @property
    def quality(self) -> float:
        """Return what panoramas are ranked by."""
        return (self.layout_iou + self.f1) / 2


def main() -> None:
    """Rank and draw."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("run", type=Path)
    choice = parser.parse_args()
    items = {x.name: x for split in SPLITS for x in open_dataset(choice.data, split)}
    ranked = sorted(
        (
            rank(items[file.stem], read_scene(choice.run / PREDICTIONS / ROW / file.name))
            for file in sorted((choice.run / TARGETS).glob("*.json"))
        ),
        key=lambda one: -one.quality,
    )
    step = (len(ranked) - 1) / (TEN - 1)
    ten = [ranked[round(k * step)] for k in range(TEN)]
    worst = ranked[-WORST:]
    OUTPUT.mkdir(parents=True, exist_ok=True)
    for name, some in (("best", ten[:5]), ("rest", ten[5:]), ("worst", worst)):
        rows = [
            picture(items[x.name], read_scene(choice.run / PREDICTIONS / ROW / f"{x.name}.json"))
            for x in some
        ]
        save(rows, OUTPUT / f"{name}.webp")
    second = ten[1].name
    found = read_scene(choice.run / PREDICTIONS / ROW / f"{second}.json")
    save([every_side(items[second], found)], OUTPUT / "every-side.webp")
    facts = {"ten": [asdict(x) for x in ten], "worst": [asdict(x) for x in worst]}
    write_atomically(OUTPUT / "panoramas.json", json.dumps(facts, indent=2) + "\n")


def rank(item: PanoramaItem, found: Scene) -> Ranked:
    """Return how well a panorama was understood."""
    truth = item.scene()
    hits = int((match_objects(found.objects, truth.objects) >= 0).sum())
    counts = (len(found.objects.boxes), len(truth.objects.boxes))
    layout = layout_record(found, truth).regularised
    return Ranked(
        item.name,
        item.split,
        round(layout.errors.iou_3d, 3),
        (len(found.layout.floor_polygon), len(truth.layout.floor_polygon)),
        (*counts, hits),
        round(2 * hits / max(sum(counts), 1), 3),
    )


def picture(item: PanoramaItem, found: Scene) -> Image.Image:
    """Return prediction and truth on the photo, and the prediction from above over the truth."""
    truth = item.scene()
    image = upright_photo(item.image(), truth.panorama)
    with tempfile.TemporaryDirectory() as folder:
        parts = []
        for k, scene in enumerate((found, truth)):
            file = Path(folder) / f"{k}.png"
            draw_overlay(scene, file, image=image, labels=k == 0, tolerance=FORGIVEN)
            parts.append(opened(file))
        file = Path(folder) / "above.png"
        draw_birds_eye(
            found, file, reference=truth, relations=False, title=item.name, caption="",
            tolerance=FORGIVEN,
        )  # fmt: skip
        parts.append(opened(file))
    row = Image.new("RGB", (sum(part.width for part in parts), HEIGHT), "white")
    left = 0
    for part in parts:
        row.paste(part, (left, 0))
        left += part.width
    return row


def every_side(item: PanoramaItem, found: Scene) -> Image.Image:
    """Return photo, prediction on it, from above, from outside and from the camera."""
    image = upright_photo(item.image(), found.panorama)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "sheet.png"
        row = SheetRow(
            item.name,
            found,
            image=image,
            rendering=render_panorama(found),
            view=render_view(found, default_view(found)),
        )
        draw_sheet([row], file, labels=True, tolerance=FORGIVEN)
        return opened(file, SHEET_HEIGHT)


def opened(file: Path, height: int = HEIGHT) -> Image.Image:
    """Return a picture at the height of a row."""
    with Image.open(file) as picture:
        width = round(picture.width * height / picture.height)
        return picture.convert("RGB").resize((width, height), Image.Resampling.LANCZOS)


def save(rows: list[Image.Image], path: Path) -> None:
    """Write rows below each other, as well as the size of a file allows."""
    size = max(row.width for row in rows), sum(row.height for row in rows)
    page, top = Image.new("RGB", size, "white"), 0
    for row in rows:
        page.paste(row, (0, top))
        top += row.height
    for quality in range(80, 20, -10):
        page.save(path, quality=quality, method=6)
        if path.stat().st_size <= LARGEST:
            return
    raise SystemExit(f"{path}: larger than {LARGEST} bytes at the lowest quality")


if __name__ == "__main__":
    torch.set_num_threads(1)
    main()
