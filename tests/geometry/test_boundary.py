"""HorizonNet signals from a room, and a room back from any signals."""

import math

import numpy as np
import pytest
import shapely
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch import Tensor
from torch.autograd import gradcheck

from panoscene.geometry._boundary import (
    CORNER_DECAY,
    boundary_from_layout,
    column_lon,
    corner_signal_from_layout,
)
from panoscene.geometry._boundary_columns import columns_from_signals, corner_peaks
from panoscene.geometry._boundary_inverse import RecoveredLayout, _best, layout_from_boundary
from panoscene.geometry._layout import corner_visible, wall_distance
from panoscene.geometry._polygon import polygon_contains
from panoscene.geometry._polygon_validity import is_manhattan, polygon_iou, polygon_problem
from panoscene.geometry._sphere import pixel_from_direction

WIDTH, CAMERA, CEILING = 1024, 1.6, 2.7


def room(*corners: tuple[float, float]) -> Tensor:
    return torch.tensor(corners, dtype=torch.float64)


RECTANGLE = room((-2, -1), (3, -1), (3, 2), (-2, 2))
ROOMS = {
    "rectangle": RECTANGLE,
    "l": room((-1, -1), (3, -1), (3, 1), (1, 1), (1, 3), (-1, 3)),
    "l with a hidden corner": room((-1, -1), (3, -1), (3, 3), (0.8, 3), (0.8, 1), (-1, 1)),
    "t": room((-3, 1), (-3, -1), (3, -1), (3, 1), (1, 1), (1, 4), (-1, 4), (-1, 1)),
    "u": room((-3, -1), (3, -1), (3, 2), (1.2, 2), (1.2, 1), (-1.2, 1), (-1.2, 2), (-3, 2)),
}
# the ends of the arms cannot be seen
DEEP_U = room((-3, -1), (3, -1), (3, 4), (2, 4), (2, 1), (-2, 1), (-2, 4), (-3, 4))
OBLIQUE = {
    "cut corner": room((-2, -1), (3, -1), (3, 1), (2, 2.2), (-2, 2)),
    "hexagon": torch.stack(
        (torch.cos(torch.arange(6) * math.pi / 3), torch.sin(torch.arange(6) * math.pi / 3)), -1
    ).double()
    * 2.5,
    "triangle": room((-2, -1), (3, -1.5), (0.5, 3)),
    "not convex": room((-2, -2), (3, -1), (2.5, 3), (0.2, 1), (-2, 2.5)),
}


def turned(polygon: Tensor, angle: float) -> Tensor:
    cos, sin = math.cos(angle), math.sin(angle)
    return polygon @ torch.tensor([[cos, sin], [-sin, cos]], dtype=polygon.dtype)


def recovered(
    polygon: Tensor, noise_deg: float = 0.0, seed: int = 0, *, corners: bool = True, **options: bool
) -> RecoveredLayout:
    """Return the room found from a room's own signals, with noise on both boundaries."""
    generator = torch.Generator().manual_seed(seed)
    noise = torch.randn(2, WIDTH, generator=generator, dtype=torch.float64)
    ceiling_lat, floor_lat = boundary_from_layout(polygon, 0.0, CEILING, CAMERA, WIDTH)
    signal = corner_signal_from_layout(polygon, WIDTH) * corners
    noise *= math.radians(noise_deg)
    return layout_from_boundary(
        ceiling_lat + noise[0], floor_lat + noise[1], signal, CAMERA, **options
    )


def visible_iou(polygon: Tensor, other: Tensor) -> float:
    """Return the IoU of the parts of two rooms that the camera sees, by rays."""
    lon = column_lon(4096, dtype=torch.float64)
    first, second = wall_distance(polygon, lon), wall_distance(other, lon)
    return float(
        (torch.minimum(first, second) ** 2).sum() / (torch.maximum(first, second) ** 2).sum()
    )


def random_manhattan_room(rng: np.random.Generator) -> Tensor:
    """Return a turned room of 4 to 10 corners with the camera at least 0.4 m from its walls."""
    while True:
        width, depth = rng.uniform(2.5, 8, 2)
        shape = shapely.box(0, 0, width, depth)
        for _ in range(rng.integers(0, 4)):
            a, b = rng.uniform(0.5, 0.6 * width), rng.uniform(0.5, 0.6 * depth)
            x, y = rng.choice([0, width - a, rng.uniform(0, width - a)]), rng.choice([0, depth - b])
            shape = shape.difference(shapely.box(x, y, x + a, y + b))
        if shape.geom_type != "Polygon" or len(shape.interiors):
            continue
        outline = shapely.get_coordinates(shapely.normalize(shape.simplify(1e-9)))[:0:-1]
        shortest = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).min()
        camera = rng.uniform((0, 0), (width, depth))
        roomy = shape.buffer(-0.4).contains(shapely.Point(camera))
        if 4 <= len(outline) <= 10 and shortest > 0.4 and roomy:
            return turned(torch.tensor(outline - camera), rng.uniform(-4, 4))


def check_is_room(found: RecoveredLayout) -> None:
    assert polygon_problem(found.polygon) is None
    assert bool(polygon_contains(torch.zeros(1, 2).to(found.polygon), found.polygon).all())
    assert CAMERA < found.ceiling_height < 20
    assert math.isfinite(found.reprojection_error)
    assert float(found.polygon.abs().max()) <= 1.5 * 20


# ---- signals from a room


@pytest.mark.parametrize("polygon", ROOMS.values(), ids=ROOMS.keys())
def test_boundary_is_where_the_edges_project(polygon: Tensor) -> None:
    ceiling_lat, floor_lat = boundary_from_layout(polygon, 0.0, CEILING, CAMERA, WIDTH)
    outline = shapely.Polygon(polygon.numpy()).exterior
    for column in range(0, WIDTH, 37):
        lon = float(column_lon(WIDTH, dtype=torch.float64)[column])
        line = shapely.LineString([(0, 0), (40 * math.sin(lon), 40 * math.cos(lon))])
        distance = line.intersection(outline).distance(shapely.Point(0, 0))
        assert float(ceiling_lat[column]) == pytest.approx(math.atan2(CEILING - CAMERA, distance))
        assert float(floor_lat[column]) == pytest.approx(math.atan2(-CAMERA, distance))


def test_boundary_passes_through_projected_corners() -> None:
    polygon = RECTANGLE.float()
    _, floor_lat = boundary_from_layout(polygon, 0.0, CEILING, CAMERA, 8192)
    corners = torch.cat((polygon, torch.full((4, 1), -CAMERA)), dim=-1)
    uv = pixel_from_direction(corners, 4096, 8192)
    v = (0.5 - floor_lat / math.pi) * 4096
    found = v[uv[:, 0].long()]
    torch.testing.assert_close(found, uv[:, 1], atol=1.5, rtol=0)


def test_boundary_of_batches_and_padding() -> None:
    rooms = torch.stack((torch.cat((RECTANGLE, RECTANGLE[-1:].expand(2, 2))), ROOMS["l"]))
    heights = torch.tensor([2.5, 3.0], dtype=torch.float64)
    together = boundary_from_layout(rooms, 0.0, heights, CAMERA, 64)
    signals = corner_signal_from_layout(rooms, 64)
    for index, polygon in enumerate((RECTANGLE, ROOMS["l"])):
        alone = boundary_from_layout(polygon, 0.0, float(heights[index]), CAMERA, 64)
        torch.testing.assert_close(together[0][index], alone[0])
        torch.testing.assert_close(together[1][index], alone[1])
        torch.testing.assert_close(signals[index], corner_signal_from_layout(polygon, 64))


def test_boundary_gradcheck() -> None:
    def boundary(polygon: Tensor, ceiling: Tensor, camera: Tensor) -> tuple[Tensor, Tensor]:
        return boundary_from_layout(polygon, 0.0, ceiling, camera, 32)

    heights = [torch.tensor(h, dtype=torch.float64, requires_grad=True) for h in (CEILING, CAMERA)]
    assert gradcheck(boundary, (ROOMS["u"].clone().requires_grad_(), *heights))


def test_camera_outside_sees_the_horizon() -> None:
    outside = (RECTANGLE + 10).requires_grad_()
    ceiling_lat, floor_lat = boundary_from_layout(outside, 0.0, CEILING, CAMERA, 64)
    assert ceiling_lat[0] == floor_lat[0] == 0
    assert floor_lat.min() < -0.05
    floor_lat.sum().backward()
    assert outside.grad is not None
    assert bool(outside.grad.isfinite().all())


def test_corner_signal_by_hand() -> None:
    # one corner at lon = pi, on the seam: half a column from the first and the last centre
    polygon = room((0, -2), (2, 1), (-2, 1))
    signal = corner_signal_from_layout(polygon, WIDTH)
    expected = CORNER_DECAY ** torch.tensor([0.5, 1.5, 2.5, 0.5], dtype=torch.float64)
    torch.testing.assert_close(signal[[0, 1, 2, -1]], expected)
    assert len(corner_peaks(signal)[0]) == 3


def test_corner_signal_leaves_out_hidden_corners() -> None:
    polygon = ROOMS["u"]
    seen = corner_visible(polygon)
    assert not bool(seen.all())
    lon = corner_peaks(corner_signal_from_layout(polygon, WIDTH))[1]
    expected = torch.atan2(polygon[seen, 0], polygon[seen, 1]).sort().values
    torch.testing.assert_close(lon, expected, atol=0.2 * 2 * math.pi / WIDTH, rtol=0)


def test_sizes_follow_the_input() -> None:
    for dtype in (torch.float32, torch.float64):
        ceiling_lat, floor_lat = boundary_from_layout(
            RECTANGLE.to(dtype), 0.0, CEILING, CAMERA, 100
        )
        assert ceiling_lat.shape == floor_lat.shape == (100,)
        assert ceiling_lat.dtype == floor_lat.dtype == dtype
        assert corner_signal_from_layout(RECTANGLE.to(dtype), 100).dtype == dtype


# ---- a room from signals


@pytest.mark.parametrize("corners", [True, False], ids=["corners", "no corners"])
@pytest.mark.parametrize("angle", [0.0, 2.0])
@pytest.mark.parametrize("polygon", ROOMS.values(), ids=ROOMS.keys())
def test_manhattan_round_trip(polygon: Tensor, angle: float, corners: bool) -> None:
    polygon = turned(polygon, angle)
    found = recovered(polygon, corners=corners)
    check_is_room(found)
    assert found.method == "manhattan"
    assert is_manhattan(found.polygon)
    assert polygon_iou(found.polygon, polygon) > 0.99
    assert found.ceiling_height == pytest.approx(CEILING, abs=1e-3)
    noisy = recovered(polygon, noise_deg=0.5, corners=corners)
    check_is_room(noisy)
    assert polygon_iou(noisy.polygon, polygon) > 0.97
    assert noisy.ceiling_height == pytest.approx(CEILING, abs=0.02)


def test_what_cannot_be_seen_is_closed_where_sight_ends() -> None:
    found = recovered(DEEP_U)
    check_is_room(found)
    assert is_manhattan(found.polygon)
    assert visible_iou(found.polygon, DEEP_U) > 0.999
    assert found.reprojection_error < 1e-3


@pytest.mark.parametrize("manhattan", [True, False])
@pytest.mark.parametrize("polygon", OBLIQUE.values(), ids=OBLIQUE.keys())
def test_oblique_rooms_are_not_forced_to_be_manhattan(polygon: Tensor, manhattan: bool) -> None:
    for noise, least in ((0.0, 0.995), (0.5, 0.98)):
        found = recovered(polygon, noise, manhattan=manhattan)
        check_is_room(found)
        assert found.method == "general"
        assert polygon_iou(found.polygon, polygon) > least


def test_random_manhattan_rooms() -> None:
    rng = np.random.default_rng(0)
    for index in range(12):
        polygon = random_manhattan_room(rng)
        for noise, least in ((0.0, 0.99), (0.5, 0.97)):
            found = recovered(polygon, noise, index)
            check_is_room(found)
            # what no column sees is a guess
            assert visible_iou(found.polygon, polygon) > least
            if bool(corner_visible(polygon).all()):
                assert polygon_iou(found.polygon, polygon) > least


def test_spurious_and_missing_corners_do_no_harm(generator: torch.Generator) -> None:
    polygon = ROOMS["t"]
    ceiling_lat, floor_lat = boundary_from_layout(polygon, 0.0, CEILING, CAMERA, WIDTH)
    signal = torch.ones(WIDTH, dtype=torch.float64)
    found = layout_from_boundary(ceiling_lat, floor_lat, signal, CAMERA)
    assert polygon_iou(found.polygon, polygon) > 0.98
    for _ in range(4):
        signal = torch.zeros(WIDTH, dtype=torch.float64)
        signal[torch.randperm(WIDTH, generator=generator)[:100]] = 1.0
        found = layout_from_boundary(ceiling_lat, floor_lat, signal, CAMERA)
        assert polygon_iou(found.polygon, polygon) > 0.98


def test_rolled_signals_give_the_turned_room() -> None:
    polygon = ROOMS["l"]
    ceiling_lat, floor_lat = boundary_from_layout(polygon, 0.0, CEILING, CAMERA, WIDTH)
    signal = corner_signal_from_layout(polygon, WIDTH)
    for shift in (1, 300, 512, 1000):
        ceiling, floor, corner = (part.roll(shift) for part in (ceiling_lat, floor_lat, signal))
        found = layout_from_boundary(ceiling, floor, corner, CAMERA)
        # lon runs clockwise
        expected = turned(polygon, -2 * math.pi * shift / WIDTH)
        assert polygon_iou(found.polygon, expected) > 0.995


def nonsense(kind: str, generator: torch.Generator, width: int) -> tuple[Tensor, Tensor, Tensor]:
    """Return finite nonsense."""

    def draw(scale: float = 1.0) -> Tensor:
        return scale * torch.rand(width, generator=generator)

    def steps(scale: float) -> Tensor:
        count = int(torch.randint(2, 30, (1,), generator=generator))
        values = scale * torch.rand(count, generator=generator)
        return values.repeat_interleave(width // count + 1)[:width]

    if kind == "uniform":
        return draw(4) - 2, draw(4) - 2, draw()
    if kind == "sided":
        return draw(1.5), -draw(1.5), (draw() < 0.1).float()
    if kind == "steps":
        return steps(1.4), -steps(1.4), steps(1.0)
    if kind == "steps that agree":
        step = steps(1.2)
        return step, -step - draw(0.1), steps(1.0)
    if kind == "walk":
        walk = 0.02 * torch.randn(width, generator=generator).cumsum(0)
        return 0.4 + walk, walk - 0.5, draw() ** 8
    scale = 10.0 ** (4 * float(draw()[0]))
    return scale * draw(), -scale * draw(), -scale * draw()


KINDS = ["uniform", "sided", "steps", "steps that agree", "walk", "huge"]


@settings(max_examples=60)
@given(
    st.sampled_from(KINDS),
    st.integers(0, 10**6),
    st.sampled_from([16, 25, 40]),
    st.booleans(),
)
def test_any_finite_signal_gives_a_room(kind: str, seed: int, width: int, manhattan: bool) -> None:
    generator = torch.Generator().manual_seed(seed)
    found = layout_from_boundary(*nonsense(kind, generator, width), CAMERA, manhattan=manhattan)
    check_is_room(found)
    assert found.polygon.dtype == torch.float32


@pytest.mark.parametrize("kind", KINDS)
def test_nonsense_at_full_width_gives_a_room(kind: str) -> None:
    for seed in range(2):
        generator = torch.Generator().manual_seed(seed)
        check_is_room(layout_from_boundary(*nonsense(kind, generator, WIDTH), CAMERA))


@pytest.mark.parametrize("floor", [-1e6, -math.pi / 2, -0.5, -1e-8, 0.0, 0.5, 1e6])
@pytest.mark.parametrize("ceiling", [-1.0, 0.0, 1e-8, 0.3, math.pi / 2, 1e6])
def test_constant_signals_give_a_room(ceiling: float, floor: float) -> None:
    for corner in (0.0, 7.0):
        lats = torch.full((32,), ceiling), torch.full((32,), floor)
        check_is_room(layout_from_boundary(*lats, torch.full((32,), corner), CAMERA))


def test_the_horizon_counts_as_max_distance() -> None:
    zeros = torch.zeros(256)
    for limit in (5.0, 30.0):
        found = layout_from_boundary(zeros, zeros, zeros, CAMERA, max_distance=limit)
        farthest = float(found.polygon.norm(dim=-1).max())
        assert 0.9 * limit < farthest < 1.5 * limit


@pytest.mark.parametrize("name", ["ceiling_lat", "floor_lat", "corner_probability"])
@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_signals_that_are_not_finite_are_refused(name: str, bad: float) -> None:
    parts = {key: torch.zeros(64) for key in ("ceiling_lat", "floor_lat", "corner_probability")}
    parts[name][7] = bad
    with pytest.raises(ValueError, match=name):
        layout_from_boundary(
            parts["ceiling_lat"], parts["floor_lat"], parts["corner_probability"], CAMERA
        )


def test_arguments_that_make_no_sense_are_refused() -> None:
    lat = torch.zeros(64)
    for height in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ValueError, match="camera_height"):
            layout_from_boundary(lat, lat, lat, height)
    assert layout_from_boundary(lat, lat, lat, 1e-3).ceiling_height > 1e-3
    with pytest.raises(ValueError, match="max_distance"):
        layout_from_boundary(lat, lat, lat, CAMERA, max_distance=0.0)
    with pytest.raises(ValueError, match="at least 16 columns"):
        layout_from_boundary(lat[:8], lat[:8], lat[:8], CAMERA)


def test_a_square_when_no_candidate_is_a_room() -> None:
    ceiling_lat, floor_lat = boundary_from_layout(RECTANGLE, 0.0, CEILING, CAMERA, WIDTH)
    columns = columns_from_signals(ceiling_lat, floor_lat, torch.zeros(WIDTH), CAMERA, 20.0)
    # a room without the camera, and one that crosses itself
    candidates = [RECTANGLE + 10, RECTANGLE[[0, 2, 1, 3]]]
    method, polygon, error = _best({"manhattan": candidates}, columns)
    assert method == "fallback"
    assert polygon_problem(polygon) is None
    assert polygon_iou(polygon, RECTANGLE) > 0.3
    assert 0 < error < 0.5
