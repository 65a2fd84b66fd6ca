"""Small models made of boxes, and homes of one room."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from panoscene.synth.assets import CadModel, Material
from panoscene.synth.homes import Home, Placed, Room

Box = tuple[tuple[float, float, float], tuple[float, float, float]]


def model_of(identifier: str, category: str, boxes: list[Box], **details: Any) -> CadModel:
    """Return a model of boxes given by extents and lowest corners, in a frame of its own."""
    parts = []
    for extents, low in boxes:
        part = trimesh.creation.box(extents=extents)
        part.apply_translation(np.array(low) + np.array(extents) / 2)
        parts.append(part)
    return model_of_mesh(identifier, category, joined(parts), **details)


def joined(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    mesh = trimesh.util.concatenate(parts)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def model_of_mesh(
    identifier: str, category: str, mesh: trimesh.Trimesh, **details: Any
) -> CadModel:
    vertices = np.array(mesh.vertices)
    vertices = (vertices - (vertices.min(axis=0) + vertices.max(axis=0)) / 2).astype(np.float32)
    width, depth, height = np.ptp(vertices, axis=0).tolist()
    return CadModel(
        id=identifier,
        base=identifier,
        category=category,
        vertices=vertices,
        normals=np.array(mesh.vertex_normals, np.float32),
        uv=np.zeros((len(vertices), 2), np.float32),
        faces=np.array(mesh.faces, np.int32),
        face_material=np.zeros(len(mesh.faces), np.int16),
        materials=(Material("plain"),),
        size=(width, depth, height),
        **details,
    )


def legs(width: float, depth: float, height: float, thick: float = 0.04) -> list[Box]:
    x, y = width - thick, depth - thick
    return [((thick, thick, height), (a, b, 0.0)) for a in (0.0, x) for b in (0.0, y)]


@pytest.fixture(scope="session")
def models() -> dict[str, CadModel]:
    """A table, chairs, a shelf, a sofa, lamps and what stands and hangs around."""
    table = [*legs(1.4, 0.8, 0.72), ((1.4, 0.8, 0.03), (0.0, 0.0, 0.72))]
    chair = [*legs(0.45, 0.45, 0.43), ((0.45, 0.45, 0.04), (0.0, 0.0, 0.43)),
             ((0.45, 0.04, 0.45), (0.0, 0.0, 0.47))]  # fmt: skip
    boards = [((0.9, 0.3, 0.02), (0.0, 0.0, z)) for z in (0.0, 0.4, 0.8, 1.2, 1.58)]
    sides = [((0.02, 0.3, 1.6), (x, 0.0, 0.0)) for x in (-0.02, 0.9)]
    sofa = [((2.0, 0.9, 0.42), (0.0, 0.0, 0.0)), ((2.0, 0.2, 0.4), (0.0, 0.0, 0.42)),
            ((0.2, 0.7, 0.2), (0.0, 0.2, 0.42)), ((0.2, 0.7, 0.2), (1.8, 0.2, 0.42))]  # fmt: skip
    foot = trimesh.creation.cylinder(0.09, 0.02)
    pole = trimesh.creation.cylinder(0.015, 0.3, transform=_up(0.16))
    shade = trimesh.creation.cone(0.14, 0.2, transform=_up(0.3))
    lamp = joined([foot, pole, shade])
    found = [
        model_of("table", "table", table, support_height=0.75),
        model_of("chair", "chair", chair),
        model_of("shelf", "shelf", boards + sides, support_height=0.42),
        model_of("sofa", "sofa", sofa, support_height=0.42),
        model_of_mesh("lamp", "table_lamp", lamp, placement="on_top"),
        model_of("book", "", [((0.15, 0.2, 0.04), (0.0, 0.0, 0.0))], placement="on_top"),
        model_of("cushion", "cushion", [((0.4, 0.12, 0.35), (0, 0, 0))], placement="on_top"),
        model_of("picture", "picture", [((0.8, 0.03, 0.6), (0, 0, 0))], placement="wall"),
        model_of("carpet", "carpet", [((2.0, 1.4, 0.03), (0, 0, 0))]),
        model_of("pendant", "", [((0.3, 0.3, 0.4), (0, 0, 0))], placement="ceiling"),
        model_of("cabinet", "chest", [((0.8, 0.5, 0.9), (0, 0, 0))], support_height=0.9),
    ]
    return {model.id: model for model in found}


def _up(z: float) -> np.ndarray:
    return trimesh.transformations.translation_matrix([0.0, 0.0, z])


@pytest.fixture(scope="session")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder where collision shapes are kept between tests."""
    return tmp_path_factory.mktemp("assets")


Put = Callable[..., Placed]


@pytest.fixture(scope="session")
def put(models: dict[str, CadModel]) -> Put:
    """Return a function that places a model by its lower edge."""

    def place(name: str, x: float, y: float, low: float = 0.0, **details: Any) -> Placed:
        height = models[name].size[2] * details.get("scale", (1, 1, 1))[2]
        details = {"room": 0, "yaw": 0.0, **details}
        return Placed(name, position=(x, y, low + height / 2), **details)

    return place


@pytest.fixture(scope="session")
def home_of() -> Callable[..., Home]:
    """Return a function that makes a home of one room, 5 x 4 m, with its corner at the origin."""

    def make(*placed: Placed, corners: list[tuple[float, float]] | None = None) -> Home:
        polygon = np.array(corners or [(0, 0), (5, 0), (5, 4), (0, 4)], np.float64)
        return Home(0, (Room("living", polygon, 2.6),), (), placed)

    return make
