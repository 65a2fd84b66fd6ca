"""Where panoramas are taken."""

import dataclasses

import numpy as np
import pytest
import shapely

from panoscene.synth.homes import Home
from panoscene.synth.render import (
    Camera,
    RenderScene,
    free_floor,
    home_from_camera,
    pixel_rays,
    sample_cameras,
)


def test_cameras_keep_away_from_walls_and_furniture(home: Home, scene: RenderScene):
    cameras = sample_cameras(home, scene.placed, np.random.default_rng(0), 40, robust=True)
    assert len(cameras) == 40
    rooms = [shapely.Polygon(room.polygon) for room in home.rooms]
    walls = shapely.union_all([room.exterior for room in rooms])
    doorway = shapely.box(4.9, 0.5, 5.22, 1.6)  # walls end at the jambs
    for camera in cameras:
        place = shapely.Point(camera.position[:2])
        assert rooms[camera.room].contains(place)
        assert place.distance(walls.difference(doorway)) > 0.38
        for placed in scene.placed:
            low = placed.world_from_object[2, 3] - placed.model.size[2] / 2
            if low < 1.9 + 0.45:
                corners = placed.model.vertices @ placed.world_from_object[:3, :3].T
                plan = corners[:, :2] + placed.world_from_object[:2, 3]
                outline = shapely.MultiPoint(plan).convex_hull
                assert outline.distance(place) > 0.28
        assert 1.2 <= camera.position[2] <= 1.9
        assert np.hypot(camera.pitch, camera.roll) <= np.radians(5.0) + 1e-9


def test_upright_cameras_stand_at_the_papers_height_in_both_rooms(home: Home, scene: RenderScene):
    cameras = sample_cameras(home, scene.placed, np.random.default_rng(1), 5)
    assert {camera.position[2] for camera in cameras} == {1.6}
    assert {camera.pitch for camera in cameras} | {camera.roll for camera in cameras} == {0.0}
    assert {camera.room for camera in cameras} == {0, 1}
    again = sample_cameras(home, scene.placed, np.random.default_rng(1), 5)
    assert again == cameras


def test_no_camera_where_there_is_no_floor(home: Home, scene: RenderScene):
    assert sample_cameras(home, scene.placed, np.random.default_rng(0), 0) == ()
    with pytest.raises(ValueError, match="count must not be negative, found -1"):
        sample_cameras(home, scene.placed, np.random.default_rng(0), -1)


def test_pixel_rays_follow_the_conventions():
    rays = pixel_rays(Camera((0.0, 0.0, 1.6), width=8, height=4))
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1)
    lon, lat = np.pi / 8, np.pi / 8  # column 4, row 1
    expected = np.cos(lat) * np.sin(lon), np.cos(lat) * np.cos(lon), np.sin(lat)
    np.testing.assert_allclose(rays[1, 4], expected)


def test_pitch_looks_up_and_roll_leans_to_the_right():
    up = home_from_camera(Camera((0.0, 0.0, 1.6), pitch=0.1)) @ (0.0, 1.0, 0.0)
    np.testing.assert_allclose(up, (0.0, np.cos(0.1), np.sin(0.1)))
    top = home_from_camera(Camera((0.0, 0.0, 1.6), roll=0.1)) @ (0.0, 0.0, 1.0)
    np.testing.assert_allclose(top, (np.sin(0.1), 0.0, np.cos(0.1)))


def test_low_cameras_keep_away_from_what_is_as_high_as_they_are(home: Home, scene: RenderScene):
    """A chest of 1.3 m is far below a camera at 1.9 m, but beside one at 1.2 m."""
    tall = dataclasses.replace(scene.placed[4], world_from_object=np.eye(4))
    tall.world_from_object[:3, 3] = 7.0, 2.0, 0.65
    tall.world_from_object[2, 2] = 1.3 / tall.model.size[2]
    outline = shapely.box(6.2, 1.0, 7.8, 3.0)
    for height, lowest, clear in ((1.9, None, 0.35), (1.9, 1.2, 0.55)):
        origin, free, _ = free_floor(home, [tall], height, lowest)
        rows, columns = np.nonzero(free)
        places = shapely.points(origin + (np.stack([columns, rows], axis=1) + 0.5) * 0.05)
        apart = shapely.distance(outline, places)
        assert clear - 0.05 < apart.min() < clear + 0.1
