"""Rooms and scenes that several tests of the vocabulary use."""

import dataclasses
from collections.abc import Callable

import pytest
import torch

from panoscene.geometry import OrientedBoxes
from panoscene.scene import (
    Layout,
    Mesh,
    Objects,
    Panorama,
    Relations,
    Scene,
    Shapes,
    objects_from_boxes,
    scene_from_boxes,
)


def identical(a: object, b: object) -> bool:
    """Return whether two records agree bit for bit, in dtype, shape and value."""
    if dataclasses.is_dataclass(a):
        return type(a) is type(b) and all(
            identical(getattr(a, field.name), getattr(b, field.name))
            for field in dataclasses.fields(a)
        )
    if isinstance(a, torch.Tensor):
        return isinstance(b, torch.Tensor) and a.dtype == b.dtype and torch.equal(a, b)
    if isinstance(a, tuple):
        return (
            isinstance(b, tuple)
            and len(a) == len(b)
            and all(identical(x, y) for x, y in zip(a, b, strict=True))
        )
    return type(a) is type(b) and a == b


@pytest.fixture(name="same", scope="session")
def fixture_same() -> Callable[[object, object], bool]:
    return identical


@pytest.fixture
def room() -> Layout:
    """A square room of 4 x 4 m; walls: south, east, north, west."""
    return Layout(torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]))


@pytest.fixture
def bedroom(room: Layout) -> Scene:
    """A bed and a nightstand at the north wall, a lamp at the ceiling, a picture on the east wall.

    The bed's head is at the wall, so it faces south (yaw pi).
    """
    boxes = OrientedBoxes(
        torch.tensor([[0.0, 1.0, 0.3], [1.05, 1.75, 0.25], [-1.0, -1.0, 2.3], [1.98, 0.0, 1.5]]),
        torch.tensor([[1.6, 2.0, 0.6], [0.5, 0.5, 0.5], [0.3, 0.3, 0.6], [1.0, 0.04, 0.6]]),
        torch.tensor([-torch.pi, -torch.pi, 0.0, torch.pi / 2]),
    )
    names = ["bed", "bottom_cabinet", "floor_lamp", "picture"]
    objects = objects_from_boxes(boxes, names, id=("bed", "nightstand", "lamp", "picture"))
    return scene_from_boxes(objects, room, name="bedroom")


def random_scene(seed: int, n: int, dtype: torch.dtype = torch.float32) -> Scene:
    """Return a scene in which every field of every record carries arbitrary numbers."""
    generator = torch.Generator().manual_seed(seed)

    def uniform(*shape: int) -> torch.Tensor:
        return torch.rand(shape, generator=generator, dtype=dtype)

    corners = 4 + seed % 3
    angle = torch.arange(corners, dtype=dtype) * (2 * torch.pi / corners)
    polygon = torch.stack((angle.cos(), angle.sin()), -1) * (2 + uniform(corners, 1))
    boxes = OrientedBoxes(
        uniform(n, 3) * 6 - 3, uniform(n, 3) * 2 + 1e-3, (uniform(n) * 2 - 1) * torch.pi
    )
    meshes = tuple(
        Mesh(uniform(4, 3) - 0.5, torch.tensor([[0, 1, 2], [1, 2, 3]])) if k % 2 else None
        for k in range(n)
    )
    bfov_scale = torch.tensor([torch.pi, torch.pi / 2, torch.pi, torch.pi], dtype=dtype)
    bfov = (uniform(n, 4) - torch.tensor([0.5, 0.5, 0.0, 0.0], dtype=dtype)) * bfov_scale
    return Scene(
        panorama=Panorama(
            width=2048,
            height=1024,
            camera_height=1.4 + seed % 7 / 7,
            file="photo.jpg",
            upright_from_photo=((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
        ),
        layout=Layout(polygon, 0.01, 2.5 + seed % 9 / 9, uniform(corners)),
        objects=Objects(
            boxes=boxes,
            category=torch.randint(0, 57, (n,), generator=generator),
            score=uniform(n),
            bfov=bfov,
            distance_score=uniform(n),
            yaw_score=uniform(n),
            id=tuple(f"Gegenstand {k} \u00fc" for k in range(n)),
            shapes=Shapes(uniform(n, 5) * 8 - 4 if n else None, meshes if n > 1 else ()),
        ),
        relations=Relations(
            touching=uniform(n, n),
            touching_wall=uniform(n, corners),
            on_floor=uniform(n),
            under_ceiling=uniform(n),
            inside_room=uniform(n),
            farther_than=uniform(n, n).round(),
            relative_yaw=uniform(n, n, 8),
            relative_yaw_wall=uniform(n, corners, 8),
        ),
        name=f"room {seed}",
        seed=seed,
    )


@pytest.fixture(name="random_scene", scope="session")
def fixture_random_scene() -> Callable[..., Scene]:
    return random_scene
