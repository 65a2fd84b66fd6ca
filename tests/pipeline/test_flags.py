"""Photos that do not show the whole sphere, and what is told of results."""

import math
from collections.abc import Callable
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from panoscene.models.layout import LayoutStage, load_layout_stage
from panoscene.pipeline import Pipeline, SphereGaps, sphere_gaps
from panoscene.pipeline._flags import scene_flags
from panoscene.sample import sample_photo_path
from panoscene.scene import Scene, read_panorama, select_objects

from .conftest import Knowing

ROWS, COLUMNS = 512, 1024
BAND = 43
"""Rows of 15 degrees."""


@pytest.fixture(scope="module")
def photo() -> Tensor:
    image, _ = read_panorama(sample_photo_path())
    return torch.nn.functional.interpolate(image[None], size=(ROWS, COLUMNS), mode="area")[0]


def letterbox(image: Tensor, colour: float = 0.0) -> Tensor:
    image[:, :BAND] = image[:, -BAND:] = colour
    return image


def blurred(image: Tensor) -> Tensor:
    small = torch.nn.functional.interpolate(image[None], scale_factor=1 / 32, mode="area")
    soft = torch.nn.functional.interpolate(small, size=(ROWS, COLUMNS), mode="bilinear")[0]
    image[:, -BAND:] = soft[:, -BAND:]
    return image


def repeated(image: Tensor) -> Tensor:
    image[:, -BAND:] = image[:, -BAND - 1][:, None]
    return image


@pytest.mark.parametrize(
    ("spoil", "part"),
    [
        (letterbox, "top"),
        (letterbox, "bottom"),
        (lambda image: letterbox(image, 0.5), "top"),
        (lambda image: letterbox(image, 1.0), "bottom"),
        (blurred, "bottom"),
        (repeated, "bottom"),
    ],
)
def test_bands_at_the_poles_are_found(
    photo: Tensor, spoil: Callable[[Tensor], Tensor], part: str
) -> None:
    gaps = sphere_gaps(spoil(photo.clone()))
    assert math.radians(8) < getattr(gaps, part) < math.radians(20)
    assert not gaps.whole
    assert f"degrees at the {part}" in gaps.where


def test_missing_columns_are_found(photo: Tensor) -> None:
    half = photo.clone()
    half[:, :, 300:812] = 0.0
    gaps = sphere_gaps(half)
    assert gaps.sides == pytest.approx(math.pi, abs=0.05)
    assert "180 degrees from side to side" in gaps.where


def test_a_stretched_strip_is_found(photo: Tensor) -> None:
    strip = photo[:, ROWS // 4 : 3 * ROWS // 4]
    wide = torch.nn.functional.interpolate(strip[None], size=(ROWS, COLUMNS), mode="bilinear")[0]
    gaps = sphere_gaps(wide)
    assert not gaps.whole
    assert gaps.spread > 0.13


def test_a_whole_sphere_is_whole_however_it_is_turned(photo: Tensor) -> None:
    for image in (photo, photo.roll(333, -1), photo.flip(-1)):
        assert sphere_gaps(image).whole
    assert sphere_gaps(photo[:, ::16, ::16]).whole


def test_plain_pictures_show_nothing() -> None:
    assert sphere_gaps(torch.full((3, 64, 128), 0.3)).sides == pytest.approx(2 * math.pi)


def test_flags_are_for_programs_and_people(truth: Scene, photo: Tensor) -> None:
    result = Pipeline(Knowing(truth).stages(shape=None))(letterbox(photo.clone()))
    [flag] = result.flags
    assert flag.code == "not_full_sphere"
    assert set(flag.numbers) == {"top_deg", "bottom_deg", "sides_deg", "pole_spread"}
    assert flag.as_dict() == {"code": flag.code, "text": flag.text, "numbers": flag.numbers}
    assert result.doubts == (flag.text,)
    assert "the photo does not show the whole sphere" in flag.text
    assert SphereGaps(0.0, 0.0, 0.0, 0.2).where == ""


def test_small_photos_are_told(truth: Scene, photo: Tensor) -> None:
    pipeline = Pipeline(Knowing(truth).stages(shape=None))
    [flag] = pipeline(photo[:, ::4, ::4]).flags
    assert flag.code == "low_resolution"
    assert flag.numbers == {"columns": COLUMNS // 4}
    assert flag.text == f"the photo is small: found {COLUMNS // 4} columns, expected 512 or more"
    assert pipeline(photo).flags == ()


def meadow() -> Tensor:
    """A plain sky over rough ground, as far as one can see."""
    generator = torch.Generator().manual_seed(0)
    rough = torch.rand(3, ROWS // 2, COLUMNS, generator=generator)
    ground = torch.tensor([0.3, 0.45, 0.2])[:, None, None] * (0.6 + 0.4 * rough)
    sky = torch.linspace(0.4, 0.9, ROWS // 2)[None, :, None].expand(3, -1, COLUMNS)
    return torch.cat([sky, ground], 1)


@pytest.fixture(scope="module")
def reader() -> LayoutStage:
    return load_layout_stage()


@pytest.mark.parametrize(
    "picture", [meadow, lambda: torch.full((3, ROWS, COLUMNS), 0.6)], ids=["meadow", "plain"]
)
def test_pictures_without_walls_are_no_rooms(
    truth: Scene, reader: LayoutStage, picture: Callable[[], Tensor]
) -> None:
    read = reader(picture(), camera_height=1.6)
    flags = scene_flags(read, replace(truth, layout=read.layout))
    [flag] = [flag for flag in flags if flag.code == "not_indoors"]
    assert set(flag.numbers) == {"wall_deg", "corner", "wall_score"}


def test_rooms_are_rooms(truth: Scene, photo: Tensor, reader: LayoutStage) -> None:
    read = reader(photo, camera_height=1.6)
    flags = scene_flags(read, replace(truth, layout=read.layout))
    assert "not_indoors" not in [flag.code for flag in flags]


def test_weak_walls_count_more_where_nothing_was_found(truth: Scene) -> None:
    layout = replace(truth.layout, wall_score=torch.full((len(truth.layout.floor_polygon),), 0.4))
    room = replace(truth, layout=layout)
    read = Knowing(room).layout(torch.zeros(3, 1, 2))
    nothing = select_objects(room.objects, torch.zeros(0, dtype=torch.long))
    assert scene_flags(read, room) == ()
    empty = replace(room, objects=nothing, relations=None)
    assert [flag.code for flag in scene_flags(read, empty)] == ["not_indoors", "nothing_found"]


def test_a_given_room_is_not_doubted(truth: Scene) -> None:
    assert scene_flags(None, truth) == ()
