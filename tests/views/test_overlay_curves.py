"""Curves of the panorama lie on their lines, never jump, and say what is hidden."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry import OrientedBoxes, box_corners, direction_from_lonlat
from panoscene.scene import CATEGORIES, Layout, Objects, Panorama, Scene
from panoscene.synth import sample_room
from panoscene.views._arcs import cut_curves, sample_lines
from panoscene.views._curves import Curve, overlay_curves

SQUARE = [(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)]
ELL = [(-1.0, -1.0), (4.0, -1.0), (4.0, 1.0), (1.0, 1.0), (1.0, 5.0), (-1.0, 5.0)]


def make_scene(
    *items: tuple[str, tuple[float, float, float], tuple[float, float, float], float],
    corners: list[tuple[float, float]] = SQUARE,
) -> Scene:
    """Return a room with boxes of category, centre, size and yaw."""
    n = len(items)
    boxes = OrientedBoxes(
        torch.tensor([item[1] for item in items], dtype=torch.float64).reshape(n, 3),
        torch.tensor([item[2] for item in items], dtype=torch.float64).reshape(n, 3),
        torch.tensor([item[3] for item in items], dtype=torch.float64),
    )
    one = torch.ones(n, dtype=torch.float64)
    category = torch.tensor([CATEGORIES.index(item[0]) for item in items], dtype=torch.int64)
    bfov = torch.zeros(n, 4, dtype=torch.float64)
    objects = Objects(boxes, category, one, bfov, one, one)
    layout = Layout(torch.tensor(corners, dtype=torch.float64))
    return Scene(Panorama(1024, 512), layout, objects)


def of(scene: Scene, kind: str, *, visible: bool | None = None) -> list[Curve]:
    return [
        curve
        for curve in overlay_curves(scene)
        if curve.kind == kind and (visible is None or curve.visible == visible)
    ]


def length(curves: list[Curve]) -> float:
    """Return the angle that curves take at the camera, in radians."""
    total = 0.0
    for curve in curves:
        ray = direction_from_lonlat(torch.as_tensor(curve.lonlat))
        total += float(2 * torch.asin((ray[1:] - ray[:-1]).norm(dim=-1) / 2).sum())
    return total


def check(curves: tuple[Curve, ...]) -> None:
    for curve in curves:
        lon, lat = curve.lonlat.T
        assert len(lon) >= 2
        assert (np.abs(lon) <= np.pi).all()
        assert (np.abs(lat) <= np.pi / 2).all()
        assert np.abs(np.diff(lon)).max() < np.deg2rad(1.01), "no jump across the picture"
        ray = np.stack([np.cos(lat) * np.sin(lon), np.cos(lat) * np.cos(lon), np.sin(lat)])
        assert np.linalg.norm(np.diff(ray), axis=0).max() < np.deg2rad(0.51)


@settings(max_examples=10)
@given(
    seed=st.integers(0, 10_000),
    objects=st.integers(0, 12),
    corners=st.sampled_from([4, 6, 8, 10]),
)
def test_no_curve_of_a_room_jumps(seed: int, objects: int, corners: int) -> None:
    check(
        overlay_curves(sample_room(np.random.default_rng(seed), objects=objects, corners=corners))
    )


point = st.tuples(*[st.floats(-4, 4, width=32)] * 3)


@given(st.lists(st.tuples(point, point), min_size=1, max_size=5))
def test_samples_lie_on_their_lines(lines: list[tuple[tuple, tuple]]) -> None:
    start, end = (np.array([line[k] for line in lines]) for k in (0, 1))
    samples = sample_lines(start, end)
    first, last = start[samples.line], end[samples.line]
    along = last - first
    off = np.linalg.norm(np.cross(samples.place - first, along), axis=-1)
    assert (off <= 1e-5 * np.linalg.norm(along, axis=-1)).all()
    ray = direction_from_lonlat(torch.as_tensor(np.stack([samples.lon, samples.lat], -1))).numpy()
    distance = np.linalg.norm(samples.place, axis=-1)
    far = distance > 0.05  # nearer, the angle between rounded numbers says little
    miss = np.linalg.norm(samples.place / np.maximum(distance, 1e-9)[:, None] - ray, axis=-1)
    assert (miss[far] < 1e-4).all()
    bounds = np.searchsorted(samples.line, np.arange(len(lines) + 1))
    for low, high in pairwise(bounds):
        if high > low:
            for _, curve in cut_curves(
                samples.lon[low:high], samples.lat[low:high], np.ones(high - low, dtype=bool)
            ):
                # at the poles themselves rounding decides what the lon is
                away = np.abs(curve[:, 1]) < np.deg2rad(89.99)
                step = np.abs(np.diff(curve[:, 0]))[away[1:] & away[:-1]]
                assert (step < np.deg2rad(2.0)).all()


def test_corners_of_boxes_are_ends_of_their_edges() -> None:
    scene = make_scene(("chair", (0.4, 1.8, 0.5), (0.5, 0.6, 1.0), 0.7))
    camera = torch.tensor([0.0, 0.0, 1.6], dtype=torch.float64)
    corners = box_corners(scene.objects.boxes)[0] - camera
    directions = (corners / corners.norm(dim=-1, keepdim=True)).numpy()
    points = np.concatenate([curve.lonlat for curve in of(scene, "edge")])
    rays = direction_from_lonlat(torch.as_tensor(points)).numpy()
    nearest = np.linalg.norm(directions[:, None] - rays[None], axis=-1).min(1)
    assert nearest.max() < 1e-12


def test_the_corner_of_a_room_is_where_the_formula_says() -> None:
    scene = make_scene()
    corner = next(curve for curve in of(scene, "corner") if curve.index == 2)
    assert np.allclose(corner.lonlat[:, 0], np.pi / 4)
    ends = np.arctan2([-1.6, 1.0], np.hypot(3, 3))
    assert np.allclose(corner.lonlat[[0, -1], 1], ends)


def test_curves_end_and_start_at_the_seam() -> None:
    # wall 0 is behind the camera and runs through lon = pi
    pieces = [curve.lonlat for curve in of(make_scene(), "floor") if curve.index == 0]
    assert len(pieces) == 2
    ends = sorted(float(lonlat[k, 0]) for lonlat in pieces for k in (0, -1))
    assert ends == pytest.approx([-np.pi, -3 * np.pi / 4, 3 * np.pi / 4, np.pi], abs=1e-12)
    at_seam = [lonlat[np.abs(np.abs(lonlat[:, 0]) - np.pi) < 1e-12] for lonlat in pieces]
    assert np.allclose(at_seam[0][0, 1], at_seam[1][0, 1])


def test_a_line_in_the_seam_is_drawn_at_both_borders() -> None:
    scene = make_scene(("shelf", (0.5, -2.0, 1.0), (1.0, 0.5, 2.0), 0.0))
    upright = [curve.lonlat for curve in of(scene, "edge") if curve.part == 10]
    assert {round(float(lonlat[0, 0]), 9) for lonlat in upright} == {
        round(np.pi, 9),
        round(-np.pi, 9),
    }


def test_a_line_through_the_pole_ends_there_on_both_sides() -> None:
    start, end = np.array([[0.0, -1.0, 1.0]]), np.array([[0.0, 1.0, 1.0]])
    samples = sample_lines(start, end)
    pieces = cut_curves(samples.lon, samples.lat, np.ones(len(samples.lon), dtype=bool))
    curves = [piece for _, piece in pieces]
    assert all(np.ptp(curve[:, 0]) < 1e-9 for curve in curves)
    assert sum(np.isclose(curve[:, 1].max(), np.pi / 2) for curve in curves) == len(curves)
    assert {round(abs(float(curve[0, 0])), 6) for curve in curves} == {0.0, round(np.pi, 6)}


def test_lines_beside_the_pole_sweep_smoothly() -> None:
    scene = make_scene(("floor_lamp", (0.0, 0.0, 2.4), (1e-3, 2.0, 0.3), 0.0))
    check(overlay_curves(scene))


def test_lines_through_the_camera_are_left_out() -> None:
    start = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    end = np.array([[0.0, 1.0, 0.0], [0.0, 2.0, 0.0], [1.0, 2.0, 0.0]])
    assert set(sample_lines(start, end).line.tolist()) == {2}


def test_the_back_of_a_box_is_hidden_and_its_front_is_not() -> None:
    scene = make_scene(("chest", (0.0, 2.0, 0.4), (1.0, 0.5, 0.8), np.pi))
    seen = {curve.part for curve in of(scene, "edge", visible=True)}
    # the front looks at the camera: front, top and the two edges that lead back on top are seen
    assert seen == {1, 2, 3, 6, 7, 10, 11}
    assert {c.part for c in of(scene, "front", visible=True)} == {0, 1, 2}
    turned = replace(
        scene,
        objects=replace(
            scene.objects, boxes=replace(scene.objects.boxes, yaw=torch.zeros(1).double())
        ),
    )
    assert not of(turned, "front", visible=True), "the arrow behind the box is hidden"


def test_boxes_hide_boxes_and_the_layout_behind_them() -> None:
    low = ("chest", (0.0, 2.5, 0.2), (0.4, 0.4, 0.4), 0.0)
    high = ("shelf", (0.0, 1.2, 1.0), (1.5, 0.3, 2.0), 0.0)
    assert of(make_scene(low), "edge", visible=True)
    both = make_scene(low, high)
    assert not [c for c in of(both, "edge", visible=True) if c.index == 0]
    lost = length(of(make_scene(), "floor", visible=True)) - length(of(both, "floor", visible=True))
    # the shelf takes atan(0.75 / 1.05) to both sides of the wall line ahead
    half = np.arctan(3 * np.tan(np.arctan(0.75 / 1.05)) / np.hypot(3, 1.6))
    assert lost == pytest.approx(2 * half, abs=np.deg2rad(1.5))


def test_walls_hide_what_is_round_the_corner() -> None:
    scene = make_scene(
        ("chair", (0.0, 4.5, 0.4), (0.4, 0.4, 0.8), 0.0),
        ("chair", (3.5, 0.5, 0.4), (0.4, 0.4, 0.8), 0.0),
        corners=ELL,
    )
    assert all(curve.visible for curve in of(make_scene(corners=ELL), "corner"))
    camera_at_the_end = replace(
        scene,
        layout=replace(
            scene.layout, floor_polygon=scene.layout.floor_polygon - torch.tensor([3.5, 0.0])
        ),
    )
    hidden = {curve.index for curve in of(camera_at_the_end, "corner", visible=False)}
    assert hidden == {4, 5}


def test_a_box_around_the_camera_hides_nothing() -> None:
    inside = make_scene(("bed", (0.0, 0.0, 1.0), (2.0, 2.0, 2.0), 0.0))
    assert all(curve.visible for curve in overlay_curves(inside))


def test_everything_is_seen_from_outside_a_room() -> None:
    corners = [(x + 10.0, y) for x, y in SQUARE]
    assert all(curve.visible for curve in overlay_curves(make_scene(corners=corners)))


def test_doors_have_no_arrow() -> None:
    scene = make_scene(
        ("door", (0.0, 2.9, 1.0), (0.9, 0.1, 2.0), np.pi),
        ("sofa", (0.0, -2.0, 0.4), (2.0, 0.9, 0.8), 0.0),
    )
    assert {curve.index for curve in of(scene, "front")} == {1}
    assert {curve.index for curve in of(scene, "edge")} == {0, 1}


def test_numbers_that_are_not_finite_are_refused() -> None:
    scene = make_scene(("sofa", (0.0, np.nan, 0.4), (2.0, 0.9, 0.8), 0.0))
    with pytest.raises(ValueError, match=r"boxes\.centre"):
        overlay_curves(scene)
