"""The building around the furniture."""

import dataclasses

import numpy as np
import pytest
import trimesh

from panoscene.synth.assets import CadModel
from panoscene.synth.homes import Home, Opening, Placed
from panoscene.synth.render import (
    RenderScene,
    RoomFinish,
    build_shell,
    scene_from_home,
    world_from_placed,
)


def _mesh(scene: RenderScene, kinds: tuple[str, ...]) -> trimesh.Trimesh:
    meshes = [
        trimesh.Trimesh(part.vertices, part.faces, process=False)
        for part in scene.parts
        if part.kind in kinds
    ]
    mesh = trimesh.util.concatenate(meshes)
    assert isinstance(mesh, trimesh.Trimesh)
    return mesh


def test_areas_of_floors_walls_and_holes(home: Home, finish: RoomFinish):
    shell = build_shell(home, [finish, finish])
    area: dict[str, float] = {}
    for part in shell.parts:
        mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
        area[part.kind] = area.get(part.kind, 0.0) + mesh.area
    assert area["floor"] == pytest.approx(5 * 4 + 3 * 4)
    assert area["ceiling"] == pytest.approx(5 * 4 + 3 * 4)
    doorway, windows = 2 * 0.9 * 2.05, (1.8 + 1.2) * 1.3
    assert area["wall"] == pytest.approx(18 * 2.6 + 14 * 2.5 - doorway - windows)


def test_faces_look_into_the_room(home: Home, finish: RoomFinish):
    shell = build_shell(home, [finish, finish])
    for part in shell.parts:
        if part.kind not in ("wall", "floor", "ceiling"):
            continue
        corners = part.vertices[part.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        middle = np.array([*home.rooms[part.room].polygon.mean(axis=0), 1.2])
        assert (((middle - corners.mean(axis=1)) * normal).sum(axis=1) > 0).all(), part.kind


def test_no_ray_gets_out_except_through_a_pane(scene: RenderScene):
    """Watertight: every ray from inside meets the building or the rectangle of a window."""
    solid = _mesh(scene, ("wall", "floor", "ceiling", "frame", "sill", "door", "skirting"))
    rng = np.random.default_rng(0)
    ways = rng.standard_normal((20000, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    starts = np.where(rng.random((20000, 1)) < 0.5, (2.5, 2.0, 1.3), (6.5, 2.0, 1.3))
    free = ~solid.ray.intersects_any(starts, ways)
    through = np.zeros(len(ways), dtype=bool)
    for pane in scene.panes:
        normal = np.array(pane.normal)
        along = ways @ normal
        t = ((np.array(pane.centre) - starts) @ normal) / np.where(along == 0, 1, along)
        off = starts + t[:, None] * ways - pane.centre
        u, v = np.array(pane.half_u), np.array(pane.half_v)
        inside = (np.abs(off @ u) <= u @ u + 1e-9) & (np.abs(off @ v) <= v @ v + 1e-9)
        through |= (t > 0) & inside
    assert free.sum() > 100
    assert through[free].all()


def test_doorways_listed_twice_are_built_once(home: Home, finish: RoomFinish):
    back = Opening("opening", 1, 3, 4 - 0.6 - 0.9, 0.9, 0.0, 2.05, leads_to=0)
    twice = dataclasses.replace(home, openings=(*home.openings, back))
    one, two = (build_shell(h, [finish, finish]) for h in (home, twice))
    assert len(one.parts) == len(two.parts)
    assert sum(len(p.faces) for p in one.parts) == sum(len(p.faces) for p in two.parts)
    assert (0, 1) in two.links


def test_closed_doors_have_a_leaf_and_pass_no_light(home: Home, finish: RoomFinish):
    door = dataclasses.replace(home.openings[0], kind="door", swing=0.0)
    closed = dataclasses.replace(home, openings=(door,))
    shell = build_shell(closed, [finish, finish])
    assert [part.kind for part in shell.parts].count("door") == 1
    assert shell.links == []
    ajar = dataclasses.replace(home, openings=(dataclasses.replace(door, swing=0.8),))
    shell = build_shell(ajar, [finish, finish])
    leaf = next(part for part in shell.parts if part.kind == "door")
    assert leaf.vertices[:, 0].min() < 5.0  # it opens into room 0
    assert shell.links == [(0, 1)]


def test_panes_take_the_id_and_the_plane_of_the_placed_window(
    home: Home, finish: RoomFinish, models: list[CadModel], glazing: CadModel
):
    window = dataclasses.replace(home.openings[1], model="glazing")
    placed = Placed("glazing", 0, (5 - 1.5 - 0.9 - 0.0, 4.08, 1.55), np.pi)
    with_window = dataclasses.replace(
        home, openings=(home.openings[0], window), placed=(*home.placed, placed)
    )
    scene = scene_from_home(with_window, [*models, glazing], [finish, finish])
    pane = scene.panes[0]
    assert pane.instance == len(with_window.placed)
    assert pane.centre[1] == pytest.approx(4.08)
    ids = [p.instance for p in scene.placed] + [p.instance for p in scene.parts]
    assert len(set(ids)) == len(ids)


def test_wrong_lengths_are_refused(home: Home, finish: RoomFinish, models: list[CadModel]):
    with pytest.raises(ValueError, match="finishes must be one for each of the 2 rooms, found 1"):
        build_shell(home, [finish])
    with pytest.raises(ValueError, match="drawn must be one model for each"):
        scene_from_home(home, models[:2], [finish, finish])


def test_placed_models_are_scaled_turned_and_moved():
    matrix = world_from_placed(Placed("x", 0, (1.0, 2.0, 3.0), np.pi / 2, (2.0, 3.0, 4.0)))
    np.testing.assert_allclose(matrix @ (0, 1, 0, 1), (-2, 2, 3, 1), atol=1e-12)
    np.testing.assert_allclose(matrix @ (0, 0, 1, 1), (1, 2, 7, 1), atol=1e-12)
