"""Photos are found from where the scene is, and are upright as the scene is."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
import torch

from panoscene.geometry import rotate_panorama
from panoscene.sample import sample_room_path
from panoscene.scene import Panorama, Scene, read_scene, relocate_photo, upright_photo
from panoscene.scene import _photos as photos_module


def tilted() -> torch.Tensor:
    """Return the rotation of a photo whose camera looked 30 degrees up."""
    up = math.radians(30)
    return torch.tensor(
        [[1, 0, 0], [0, math.cos(up), -math.sin(up)], [0, math.sin(up), math.cos(up)]],
        dtype=torch.float64,
    )


def test_photos_are_turned_upright_photo() -> None:
    image = torch.rand(3, 32, 64, generator=torch.Generator().manual_seed(0))
    assert upright_photo(image, Panorama(64, 32)) is image
    rotation = tilted()
    # as files write it, and as far off as they may be
    for rows in (rotation, (rotation * 1e4).round() / 1e4, rotation * 1.0004):
        a, b, c = (tuple(row) for row in rows.tolist())
        turned = upright_photo(image, Panorama(64, 32, upright_from_photo=(a, b, c)))
        assert torch.allclose(turned, rotate_panorama(image, rotation), atol=0.02)
    assert not torch.allclose(turned, image, atol=0.1)


def test_large_photos_are_reduced_before_they_are_turned(monkeypatch: pytest.MonkeyPatch) -> None:
    assert photos_module.MOST_TURNED == 4096
    monkeypatch.setattr(photos_module, "MOST_TURNED", 64)
    a, b, c = (tuple(row) for row in tilted().tolist())
    turned = upright_photo(torch.ones(3, 40, 80), Panorama(80, 40, upright_from_photo=(a, b, c)))
    assert turned.shape == (3, 32, 64)
    assert torch.allclose(turned, torch.ones(()), atol=1e-5)


def with_photo(file: str | None) -> Scene:
    room = read_scene(sample_room_path())
    return replace(room, panorama=replace(room.panorama, file=file))


@pytest.mark.parametrize(
    ("file", "source", "target", "found"),
    [
        ("photo.jpg", "room.json", "new.json", "photo.jpg"),
        ("photo.jpg", "room.json", "out/deep/room.json", "../../photo.jpg"),
        ("../photos/a.jpg", "rooms/room.json", "room.json", "photos/a.jpg"),
        (None, "room.json", "out/room.json", None),
    ],
)
def test_a_photo_is_found_from_the_new_place(
    file: str | None, source: str, target: str, found: str | None
) -> None:
    assert relocate_photo(with_photo(file), source, Path(target)).panorama.file == found


def test_an_absolute_photo_stays_where_it_is(tmp_path: Path) -> None:
    room = with_photo(str(tmp_path / "photo.jpg"))
    assert relocate_photo(room, "room.json", "out/room.json") is room
