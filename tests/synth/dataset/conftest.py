"""A small home of boxes, and panoramas of it with exact labels from a ray caster of their own."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from panoscene.synth.assets import CadModel, Material
from panoscene.synth.dataset import (
    HomesOfSplits,
    Recipe,
    begin_dataset,
    finish_index,
    label_panorama,
    next_jobs,
    write_panorama,
)
from panoscene.synth.render import (
    Camera,
    PartKind,
    PlacedModel,
    RenderedPanorama,
    RenderScene,
    ShellPart,
    WindowPane,
    home_from_camera,
)

BOX_FACES = np.array(
    [
        (0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4),
        (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5),
    ],
    np.int32,
)  # fmt: skip
WHITE = Material("white")


def slab(low: tuple, high: tuple) -> np.ndarray:
    bits = (np.arange(8)[:, None] >> np.arange(3)) & 1
    return np.where(bits, high, low).astype(np.float32)


def model_of(category: str, slabs: list[tuple[tuple, tuple]], base: str = "") -> CadModel:
    vertices = np.concatenate([slab(*corners) for corners in slabs])
    vertices -= (vertices.min(0) + vertices.max(0)) / 2
    faces = np.concatenate([BOX_FACES + 8 * k for k in range(len(slabs))]).astype(np.int32)
    size = tuple((vertices.max(0) - vertices.min(0)).tolist())
    name = f"test/{category or 'thing'}"
    return CadModel(
        name, base or name, category, vertices, np.zeros_like(vertices),
        np.zeros((len(vertices), 2), np.float32), faces, np.zeros(len(faces), np.int16), (WHITE,),
        size, licence="CC0-1.0", creator="A. Maker", source=f"tests: {category}",
    )  # fmt: skip


SOFA = model_of("sofa", [((-1, -0.4, 0), (1, 0.4, 0.4)), ((-1, -0.4, 0.4), (1, -0.2, 0.8))])
TABLE = model_of(
    "table",
    [((-0.8, -0.4, 0.7), (0.8, 0.4, 0.74))]
    + [((x, y, 0), (x + 0.08, y + 0.08, 0.7)) for x in (-0.8, 0.72) for y in (-0.4, 0.32)],
)
LAMP = model_of(
    "table_lamp", [((-0.1, -0.1, 0), (0.1, 0.1, 0.3)), ((-0.15, -0.15, 0.3), (0.15, 0.15, 0.45))]
)
CHAIR = model_of(
    "chair", [((-0.22, -0.22, 0), (0.22, 0.22, 0.45)), ((-0.22, -0.22, 0.45), (0.22, -0.18, 0.9))]
)
CARPET = model_of("carpet", [((-1, -0.7, 0), (1, 0.7, 0.01))])
PICTURE = model_of("picture", [((-0.4, -0.02, -0.3), (0.4, 0.02, 0.3))])
HOOD = model_of(
    "range_hood", [((-0.15, -0.2, 0), (0.15, 0.07, 0.8)), ((-0.3, -0.2, 0.05), (0.3, 0.2, 0.054))]
)
"""With a pane at its lower end that is too thin to be seen edge-on."""
VASE = model_of("", [((-0.1, -0.1, 0), (0.1, 0.1, 0.3))])


def pose(x: float, y: float, z: float, yaw: float, scale: float = 1.0) -> np.ndarray:
    cos, sin = np.cos(yaw), np.sin(yaw)
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) * scale
    matrix[:3, 3] = x, y, z
    return matrix


def quads(*corners: list) -> tuple[np.ndarray, np.ndarray]:
    vertices = np.array(corners, float).reshape(-1, 3)
    first = 4 * np.arange(len(corners))[:, None]
    return vertices, np.concatenate(
        [first + np.array([0, 1, 2]), first + np.array([0, 2, 3])]
    ).astype(np.int32)


def upright(a: tuple, b: tuple, low: float, high: float) -> list:
    return [(*a, low), (*b, low), (*b, high), (*a, high)]


ROOMS = (
    np.array([(0, 0), (5, 0), (5, 4), (0, 4)], float),
    np.array([(5.2, 0), (8, 0), (8, 4), (5.2, 4)], float),
)
HEIGHT = 2.6
DOORWAY = (1.0, 2.0, 2.1)
"""From y to y, and its top, in the walls between the rooms."""


def shell_parts() -> list[ShellPart]:
    parts: list[ShellPart] = []
    number = 100

    def add(kind: PartKind, room: int, index: int, vertices: np.ndarray, faces: np.ndarray) -> None:
        nonlocal number
        uv = np.zeros((len(vertices), 2))
        parts.append(ShellPart(kind, number, room, index, vertices, uv, faces, WHITE))
        number += 1

    low, high, top = DOORWAY
    for room, plan in enumerate(ROOMS):
        flat = [(x, y, 0.0) for x, y in plan]
        add("floor", room, 0, *quads(flat))
        add("ceiling", room, 0, *quads([(x, y, HEIGHT) for x, y in plan][::-1]))
        for wall in range(4):
            a, b = plan[wall], plan[(wall + 1) % 4]
            if (room, wall) in ((0, 1), (1, 3)):
                x = a[0]
                pieces = [
                    upright((x, 0), (x, low), 0, HEIGHT),
                    upright((x, high), (x, 4), 0, HEIGHT),
                    upright((x, low), (x, high), top, HEIGHT),
                ]
                add("wall", room, wall, *quads(*pieces))
            else:
                add("wall", room, wall, *quads(upright(tuple(a), tuple(b), 0, HEIGHT)))
    frame = [
        upright((5, low), (5.2, low), 0, top),
        upright((5, high), (5.2, high), 0, top),
        [(5, low, top), (5.2, low, top), (5.2, high, top), (5, high, top)],
        [(5, low, 0), (5.2, low, 0), (5.2, high, 0), (5, high, 0)],
    ]
    add("frame", 0, 0, *quads(*frame))
    leaf = slab((5.05, 2.0, 0.0), (5.09, 2.9, 2.1))
    add("door", 1, 0, leaf.astype(float) + np.array([0.25, 0, 0]), BOX_FACES)
    return parts


def box_home() -> RenderScene:
    placed = (
        PlacedModel(SOFA, pose(1.2, 3.55, 0.4, np.pi), 1),
        PlacedModel(TABLE, pose(2.6, 2.9, 0.37, 0.3), 2),
        PlacedModel(LAMP, pose(2.6, 2.9, 0.74 + 0.225, 0.0), 3),
        PlacedModel(CHAIR, pose(4.2, 3.4, 0.45, 2.0), 4),
        PlacedModel(CARPET, pose(2.2, 1.4, 0.005, 0.0), 5),
        PlacedModel(PICTURE, pose(0.02, 1.5, 1.6, -np.pi / 2), 6),
        PlacedModel(VASE, pose(0.5, 0.5, 0.15, 0.0), 7),
        PlacedModel(CHAIR, pose(6.8, 1.6, 0.54, 1.0, 1.2), 8, 1),
        PlacedModel(SOFA, pose(3.7, 0.9, 0.4, 0.4), 9),
    )
    pane = WindowPane(30, 0, (2.0, 0.0, 1.5), (0.6, 0.0, 0.0), (0.0, 0.0, 0.5), (0.0, 1.0, 0.0))
    return RenderScene(tuple(shell_parts()), placed, (pane,), ROOMS, (HEIGHT, HEIGHT), ((0, 1),))


def cast(scene: RenderScene, camera: Camera, seed: int = 0) -> RenderedPanorama:
    """Return a panorama: colours by instance, shaded, with a checkerboard on everything."""
    soups = [(p.vertices, p.faces, p.instance) for p in scene.parts]
    for m in scene.placed:
        matrix = m.world_from_object
        soups.append(
            (m.model.vertices @ matrix[:3, :3].T + matrix[:3, 3], m.model.faces, m.instance)
        )
    for p in scene.panes:
        c, u, v, n = (np.array(a) for a in (p.centre, p.half_u, p.half_v, p.normal))
        corners = np.array([c - u - v, c + u - v, c + u + v, c - u + v]) + 1e-4 * n
        soups.append((corners, np.array([[0, 1, 2], [0, 2, 3]], np.int32), p.instance))
    starts = np.cumsum([0] + [len(v) for v, _, _ in soups])
    vertices = np.concatenate([v for v, _, _ in soups]) - np.array(camera.position)
    faces = np.concatenate([f + s for (_, f, _), s in zip(soups, starts, strict=False)])
    owner = np.repeat([i for _, _, i in soups], [len(f) for _, f, _ in soups])
    world = EmbreeScene(robust=True)
    TriangleMesh(world, vertices.astype(np.float32), faces.astype(np.int32))
    h, w = camera.height, camera.width
    lon = 2 * np.pi * ((np.arange(w) + 0.5) / w - 0.5)
    lat = np.pi * (0.5 - (np.arange(h)[:, None] + 0.5) / h)
    local = np.stack(
        [np.cos(lat) * np.sin(lon), np.cos(lat) * np.cos(lon), np.sin(lat) + 0 * lon], axis=-1
    ).reshape(-1, 3)
    rays = (local @ home_from_camera(camera).T).astype(np.float32)
    hits = world.run(np.zeros_like(rays), rays, output=1)
    hit = hits["primID"] >= 0
    distance = np.where(hit, hits["tfar"], 0).astype(np.float32)
    instance = np.where(hit, owner[hits["primID"]], 0).astype(np.int32)
    corner = vertices[faces[hits["primID"]]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    shade = 0.45 + 0.55 * np.abs((normal * rays).sum(1))
    points = rays * distance[:, None] + np.array(camera.position)
    board = (np.floor(points * 2 + 1e-3).astype(int).sum(1) % 2) * 0.15 + 0.85
    paint = np.random.default_rng(seed).uniform(60, 230, (256, 3))
    rgb = (paint[instance % 256] * (shade * board)[:, None]).reshape(h, w, 3)
    normal = np.where(((normal * rays).sum(1) > 0)[:, None], -normal, normal)
    normal = (normal @ home_from_camera(camera)).reshape(h, w, 3).astype(np.float32)
    return RenderedPanorama(
        rgb.astype(np.uint8), distance.reshape(h, w), instance.reshape(h, w), normal,
        rgb.astype(np.uint8), rgb / 255.0, camera,
    )  # fmt: skip


CAMERA = Camera((2.4, 1.5, 1.6), yaw=0.7)
TILTED = replace(CAMERA, position=(2.0, 1.8, 1.45), yaw=-2.1, pitch=0.08, roll=-0.05)


@dataclass(frozen=True)
class Taken:
    """A home and a panorama of it."""

    scene: RenderScene
    rendered: RenderedPanorama


@pytest.fixture(scope="session")
def taken() -> Taken:
    scene = box_home()
    return Taken(scene, cast(scene, CAMERA))


@pytest.fixture(scope="session")
def tilted() -> Taken:
    scene = box_home()
    return Taken(scene, cast(scene, TILTED))


@pytest.fixture(scope="session")
def photograph() -> Callable[..., RenderedPanorama]:
    """Return the function that takes panoramas of scenes."""
    return cast


@pytest.fixture(scope="session")
def library() -> dict[str, CadModel]:
    """Return the models of the home by id."""
    return {m.id: m for m in (SOFA, TABLE, LAMP, CHAIR, CARPET, PICTURE, HOOD, VASE)}


@pytest.fixture(scope="session")
def small_set(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a set of four panoramas of four homes, 384 columns wide."""
    root = tmp_path_factory.mktemp("set")
    homes = {"train": 1, "val": 1, "test-seen": 1, "test-unseen": 1}
    recipe = Recipe(homes=HomesOfSplits.model_validate(homes), cameras=1, width=384)
    begin_dataset(root, recipe)
    scene = box_home()
    for k, job in enumerate(next_jobs(root)):
        camera = replace((CAMERA, TILTED)[k % 2], yaw=0.9 * k, width=384, height=192)
        panorama = label_panorama(
            scene,
            cast(scene, camera, k),
            name=job.cameras[0].name,
            home=job.home,
            seed=job.seed,
            room_kind="living",
            light={"kind": "overcast"},
        )
        write_panorama(panorama, root, split=job.split)
    finish_index(root)
    return root
