"""A small home to photograph: two rooms, a doorway, two windows and simple furniture."""

from collections.abc import Callable

import numpy as np
import pytest

from panoscene.synth.assets import CadModel, LightSource, Material, Placement
from panoscene.synth.homes._records import Home, Opening, Placed, Room
from panoscene.synth.render._assemble import scene_from_home
from panoscene.synth.render._records import Finish, PlacedModel, RenderScene, RoomFinish

_FACES = np.array(
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
)


def box_model(
    name: str, size, material: Material, lights=(), placement: Placement = "floor"
) -> CadModel:
    """Return a box of one material."""
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    corners = (bits - 0.5) * np.array(size)
    quads = corners[_FACES]
    normal = quads.mean(axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    first = 4 * np.arange(6)[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return CadModel(
        name, name, "cabinet", quads.reshape(-1, 3).astype(np.float32),
        np.repeat(normal, 4, axis=0).astype(np.float32),
        np.tile([[0, 0], [1, 0], [1, 1], [0, 1]], (6, 1)).astype(np.float32),
        faces.astype(np.int32), np.zeros(12, np.int16), (material,),
        size, placement, lights=lights,
    )  # fmt: skip


def plain(colour, roughness=0.9) -> Finish:
    """Return a paint."""
    return Finish(Material("paint", colour, roughness))


PLAIN = RoomFinish(
    plain((0.6, 0.45, 0.3), 0.5), (plain((0.85, 0.82, 0.76)),), plain((0.92, 0.92, 0.92)),
    plain((0.9, 0.9, 0.9), 0.5),
)  # fmt: skip


def small_home(windows: bool = True) -> Home:
    """Return a living room of 5 x 4 m and a bedroom of 3 x 4 m beside it."""
    living = np.array([[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0]])
    bedroom = np.array([[5.12, 0.0], [8.12, 0.0], [8.12, 4.0], [5.12, 4.0]])
    openings = [Opening("opening", 0, 1, 0.6, 0.9, 0.0, 2.05, leads_to=1)]
    if windows:
        openings += [
            Opening("window", 0, 2, 1.5, 1.8, 0.9, 2.2),
            Opening("window", 1, 0, 0.8, 1.2, 0.9, 2.2),
        ]
    placed = (
        Placed("sofa", 0, (1.2, 0.6, 0.35), 0.0),
        Placed("table", 0, (2.4, 2.0, 0.225), 0.2),
        Placed("mirror", 0, (0.03, 2.0, 1.5), -np.pi / 2),
        Placed("vase", 0, (2.4, 2.0, 0.6), 0.0),
        Placed("bed", 1, (7.0, 2.9, 0.25), 0.0),
        Placed("lamp", 0, (4.5, 3.6, 1.5), 0.0),
    )
    rooms = (Room("living", living, 2.6), Room("bedroom", bedroom, 2.5))
    return Home(0, rooms, tuple(openings), placed)


def models() -> list[CadModel]:
    """Return the models of the small home's pieces."""
    glow = (LightSource((0.0, 0.0, 0.0), 0.08),)
    green = Material("glass", (0.6, 0.9, 0.8), 0.1, 0.0, 0.3, "glass")
    shade = Material("shade", (0.95, 0.9, 0.8), kind="light", emission=1.0)
    return [
        box_model("sofa", (1.8, 0.8, 0.7), Material("cloth", (0.5, 0.1, 0.12), 0.9)),
        box_model("table", (1.1, 0.7, 0.45), Material("wood", (0.5, 0.33, 0.2), 0.3)),
        box_model("mirror", (0.8, 0.02, 1.2), Material("mirror", kind="mirror"), placement="wall"),
        box_model("vase", (0.15, 0.15, 0.3), green),
        box_model("bed", (1.6, 2.0, 0.5), Material("linen", (0.8, 0.82, 0.9), 0.9)),
        box_model("lamp", (0.3, 0.3, 0.3), shade, glow, "on_top"),
    ]  # fmt: skip


@pytest.fixture
def home() -> Home:
    """Return the small home."""
    return small_home()


@pytest.fixture
def finish() -> RoomFinish:
    """Return how a room is painted."""
    return PLAIN


@pytest.fixture(name="models")
def _models() -> list[CadModel]:
    return models()


@pytest.fixture
def glazing() -> CadModel:
    """Return a window that is nothing but a sheet of glass."""
    return box_model("glazing", (1.8, 0.02, 1.3), Material("pane", kind="glass", opacity=0.2))


@pytest.fixture(scope="session")
def scene() -> RenderScene:
    return scene_from_home(small_home(), models(), [PLAIN, PLAIN])


@pytest.fixture(scope="session")
def closed_box() -> Callable[[float], RenderScene]:
    """Return a maker of a room of 4 x 4 x 3 m, all of one albedo, with a bulb in its middle."""

    def make(albedo: float) -> RenderScene:
        code = 1.055 * albedo ** (1 / 2.4) - 0.055
        grey = Material("grey", (code, code, code), 1.0)
        walls = box_model("walls", (4.0, 4.0, 3.0), grey)
        bulb = box_model("bulb", (0.01, 0.01, 0.01), grey, (LightSource((0.0, 0.0, 0.0), 0.1),))
        matrix = np.eye(4)
        matrix[:3, 3] = 2.0, 2.0, 1.5
        polygon = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
        inner = [PlacedModel(walls, matrix, 1), PlacedModel(bulb, matrix, 90)]
        return RenderScene((), tuple(inner), (), (polygon,), (3.0,))

    return make
