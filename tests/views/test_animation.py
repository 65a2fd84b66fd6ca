"""The moving picture moves, rests, says what is wrong in red, and is written whole."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image

from panoscene.arrange import arrange
from panoscene.geometry import OrientedBoxes
from panoscene.scene import Layout, Scene, objects_from_boxes, scene_from_boxes
from panoscene.style import ALARM
from panoscene.views._animation import draw_animation
from panoscene.views._image_files import write_image

SMALL = (360, 240)


def crowded() -> Scene:
    """Two beds that overlap by far in a square room."""
    boxes = OrientedBoxes(
        torch.tensor([[-0.6, 1.0, 0.3], [0.6, 1.1, 0.3]]),
        torch.tensor([[1.6, 2.0, 0.6], [1.6, 2.0, 0.6]]),
        torch.zeros(2),
    )
    objects = objects_from_boxes(boxes, ["bed", "bed"])
    square = Layout(torch.tensor([[-2.5, -2.0], [2.5, -2.0], [2.5, 3.0], [-2.5, 3.0]]))
    return replace(scene_from_boxes(objects, square), relations=None)


def red(frame: Image.Image) -> int:
    """Count the pixels of the pictures, above the key, in the colour of collisions."""
    alarm = [int(ALARM[k : k + 2], 16) for k in (1, 3, 5)]
    pixels = np.asarray(frame.convert("RGB")).astype(int)[46:-64]
    return int((np.abs(pixels - alarm).max(-1) < 40).sum())


@pytest.mark.render
@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_collisions_go_and_the_last_frame_rests(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"moving{suffix}"
    scene = crowded()
    result = arrange(scene)
    assert result.certificate.after.colliding_pairs < result.certificate.before.colliding_pairs
    draw_animation(scene, file, frames=4, size_px=SMALL, reference=scene)
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    with Image.open(file) as picture:
        assert picture.size == SMALL
        assert 2 <= getattr(picture, "n_frames", 1) <= 4
        assert picture.info["loop"] == 0
        picture.load()
        first, started = red(picture), picture.info["duration"]
        picture.seek(getattr(picture, "n_frames", 1) - 1)
        picture.load()
        last, rested = red(picture), picture.info["duration"]
    assert first > 40
    assert last < first / 4
    assert rested > started > 500


@pytest.mark.render
@pytest.mark.parametrize("count", [0, 1])
def test_few_objects_and_own_states(tmp_path: Path, count: int) -> None:
    scene = crowded()
    boxes = scene.objects.boxes[:count]
    small = scene_from_boxes(objects_from_boxes(boxes, ["bed"] * count), scene.layout)
    moved = replace(boxes, centre=boxes.centre + torch.tensor([0.3, 0.0, 0.0]))
    for name in ("one.webp", "two.webp"):
        draw_animation(small, tmp_path / name, states=[boxes, moved], size_px=SMALL)
    with Image.open(tmp_path / "one.webp") as picture:
        assert getattr(picture, "n_frames", 1) == 2
    assert (tmp_path / "one.webp").read_bytes() == (tmp_path / "two.webp").read_bytes()
    draw_animation(small, tmp_path / "still.webp", states=[boxes], size_px=SMALL)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("moving.mp4", {}),
        ("moving", {}),
        ("a.webp", {"frames": 1}),
        ("a.webp", {"states": []}),
        ("a.webp", {"size_px": (100, 100)}),
        ("a.webp", {"settings": "no such preset"}),
    ],
)
def test_what_cannot_be_drawn_leaves_nothing(
    tmp_path: Path, name: str, options: dict[str, Any]
) -> None:
    with pytest.raises(ValueError, match=r"path|frames|size_px|preset"):
        draw_animation(crowded(), tmp_path / name, **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("suffix", [".png", ".PNG", ".jpg", ".webp"])
def test_images_are_written_as_they_are(tmp_path: Path, suffix: str) -> None:
    image = torch.linspace(-0.2, 1.2, 16).expand(3, 8, 16)
    file = tmp_path / f"picture{suffix}"
    write_image(image, file)
    with Image.open(file) as picture:
        pixels = np.asarray(picture.convert("RGB"))
    assert pixels.shape == (8, 16, 3)
    expected = (image.clamp(0, 1) * 255).round().permute(1, 2, 0).numpy()
    assert np.abs(pixels - expected).max() <= (0 if suffix.lower() == ".png" else 12)


def test_images_that_are_none_leave_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="path"):
        write_image(torch.zeros(3, 2, 2), tmp_path / "a.xyz")
    for image in (torch.full((3, 2, 2), torch.nan), torch.zeros(3, 0, 2)):
        with pytest.raises(ValueError, match="image"):
            write_image(image, tmp_path / "a.png")
    assert list(tmp_path.iterdir()) == []
