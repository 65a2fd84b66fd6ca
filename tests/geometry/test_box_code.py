"""The paper's parametrisation: the release's numbers, exact inverses, the seam, gradients."""

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from panoscene.geometry._angles import wrap_angle
from panoscene.geometry._box_code import (
    DISTANCE_BINS,
    YAW_BINS,
    BoxCode,
    box_centre_from_view,
    decode_box_code,
    encode_boxes,
    view_relative_yaw,
    yaw_from_view_relative,
)
from panoscene.geometry._oriented_boxes import OrientedBoxes
from panoscene.geometry._sphere import lonlat_from_direction

HEIGHT = 1.6


def released_box(
    x: float, y: float, z: float, psi: float, camera_height: float = HEIGHT
) -> OrientedBoxes:
    """Return a box given in the authors' world: camera at the origin looking along +x.

    psi turns their object's x axis, which is its left, counter-clockwise from their +x.
    """
    centre = torch.tensor([-y, x, z + camera_height], dtype=torch.float64)
    size = torch.ones(3, dtype=torch.float64)
    return OrientedBoxes(centre, size, torch.tensor(psi - math.pi / 2, dtype=torch.float64))


def random_code_input(
    count: int, generator: torch.Generator, dtype: torch.dtype
) -> tuple[OrientedBoxes, Tensor, Tensor]:
    numbers = torch.rand(count, 13, generator=generator, dtype=torch.float64).to(dtype)
    centre = (numbers[:, :3] - 0.5) * torch.tensor([22.0, 22.0, 3.0], dtype=dtype)
    # the difference of two yaws is only comparable away from the seam
    boxes = OrientedBoxes(centre, numbers[:, 3:6] * 3 + 0.01, (numbers[:, 6] - 0.5) * 6.2)
    ray = centre - torch.tensor([0.0, 0.0, HEIGHT], dtype=dtype)
    offset = (numbers[:, 7:9] - 0.5) * 0.4
    lonlat = lonlat_from_direction(ray) + offset
    bfov = torch.cat([wrap_angle(lonlat[:, :1]), lonlat[:, 1:], numbers[:, 9:11] + 0.05], dim=-1)
    return boxes, bfov, numbers[:, 10:13] + 0.1


@pytest.mark.parametrize(
    ("box", "view_yaw"),
    [
        (released_box(2.0, 0.0, 0.0, 0.0), math.pi / 2),
        (released_box(2.0, 0.0, 0.0, math.pi / 2), 0.0),
        (released_box(2.0, 0.0, 0.0, -math.pi / 2), -math.pi),
        (released_box(0.0, -2.0, 0.5, 0.3), -0.3),
    ],
)
def test_the_yaws_of_the_release(box: OrientedBoxes, view_yaw: float) -> None:
    lon = lonlat_from_direction(box.centre)[0]
    found = view_relative_yaw(box.yaw, lon)
    assert abs(wrap_angle(found - view_yaw)) < 1e-15
    again = yaw_from_view_relative(found, lon)
    assert abs(wrap_angle(again - box.yaw)) < 1e-15


@pytest.mark.parametrize(
    ("distance", "index", "residual"),
    [(3.0, 1, 0.0), (13.0, 5, 1.0), (0.5, 0, -0.25), (11.5, 5, 0.25), (2.0, 1, -0.5)],
)
def test_the_distance_bins_of_the_release(distance: float, index: int, residual: float) -> None:
    code = encode_boxes(
        released_box(distance, 0.0, 0.0, 0.0, camera_height=0.0),
        torch.tensor([0.0, 0.0, 1.0, 1.0], dtype=torch.float64),
        torch.ones(3, dtype=torch.float64),
        camera_height=0.0,
    )
    assert int(code.distance_bin) == index
    assert float(code.distance_residual) == pytest.approx(residual, abs=1e-15)


@pytest.mark.parametrize(
    ("view_yaw", "index"), [(0.3, 3), (-0.3, 2), (math.pi / 2, 4), (-3.14, 0), (3.14, 5)]
)
def test_the_yaw_bins_of_the_release(view_yaw: float, index: int) -> None:
    yaw = float(yaw_from_view_relative(torch.tensor(view_yaw), torch.tensor(0.0)))
    code = encode_boxes(
        released_box(2.0, 0.0, 0.0, yaw + math.pi / 2),
        torch.tensor([0.0, 0.0, 1.0, 1.0], dtype=torch.float64),
        torch.ones(3, dtype=torch.float64),
        camera_height=HEIGHT,
    )
    assert int(code.yaw_bin) == index
    centre = math.radians(-150 + 60 * index)
    assert float(code.yaw_residual) == pytest.approx((view_yaw - centre) / (math.pi / 3), abs=1e-6)


def test_an_object_that_faces_the_camera_or_away() -> None:
    lon = torch.tensor([-3.0, -1.0, 0.0, 0.5, 2.0], dtype=torch.float64)
    torch.testing.assert_close(view_relative_yaw(wrap_angle(-lon), lon), torch.zeros_like(lon))
    facing = view_relative_yaw(wrap_angle(math.pi - lon), lon)
    torch.testing.assert_close(facing.abs(), torch.full_like(lon, math.pi))


@pytest.mark.parametrize(("dtype", "tolerance"), [(torch.float32, 1e-5), (torch.float64, 1e-12)])
def test_decoding_inverts_encoding(
    generator: torch.Generator, dtype: torch.dtype, tolerance: float
) -> None:
    boxes, bfov, mean_size = random_code_input(500, generator, dtype)
    code = encode_boxes(boxes, bfov, mean_size, HEIGHT)
    decoded = decode_box_code(code, bfov, mean_size, HEIGHT)
    for name in ("centre", "size", "yaw"):
        found, expected = getattr(decoded, name), getattr(boxes, name)
        torch.testing.assert_close(found, expected, atol=tolerance, rtol=0.0)
        assert found.dtype == dtype
    assert code.distance_bin.unique().tolist() == list(range(DISTANCE_BINS))
    assert code.yaw_bin.unique().tolist() == list(range(YAW_BINS))
    assert code.yaw_residual.abs().max() <= 0.5 + 1e-6
    inside = torch.linalg.vector_norm(boxes.centre, dim=-1) < 10
    assert code.distance_residual[inside].abs().max() <= 0.5
    assert code.delta[:, 0].abs().max() <= 0.2 / 0.05 + 1e-5


@given(
    lon=st.floats(-3.14, 3.14),
    lat=st.floats(-1.5, 1.5),
    distance=st.floats(0.01, 30.0),
    yaw=st.floats(-20, 20),
)
def test_round_trip_near_the_seam_the_poles_and_the_camera(
    lon: float, lat: float, distance: float, yaw: float
) -> None:
    view = torch.tensor([lon, lat], dtype=torch.float64)
    centre = box_centre_from_view(view, torch.tensor(distance, dtype=torch.float64), HEIGHT)
    box = OrientedBoxes(
        centre, torch.full_like(centre, 0.4), torch.tensor(yaw, dtype=torch.float64)
    )
    bfov = torch.tensor([-3.1, 0.2, 0.3, 0.5], dtype=torch.float64)
    mean_size = torch.tensor([0.5, 1.0, 2.0], dtype=torch.float64)
    decoded = decode_box_code(encode_boxes(box, bfov, mean_size, HEIGHT), bfov, mean_size, HEIGHT)
    torch.testing.assert_close(decoded.centre, box.centre, atol=1e-12, rtol=1e-12)
    torch.testing.assert_close(decoded.size, box.size, atol=1e-12, rtol=0.0)
    assert abs(wrap_angle(decoded.yaw - box.yaw)) < 1e-11


def test_the_offset_is_wrapped_at_the_seam() -> None:
    lon = torch.tensor([math.pi - 0.05, 0.0], dtype=torch.float64)
    centre = box_centre_from_view(lon, torch.tensor(4.0, dtype=torch.float64), HEIGHT)
    box = OrientedBoxes(centre, torch.ones_like(centre), torch.tensor(0.0, dtype=torch.float64))
    bfov = torch.tensor([-math.pi + 0.05, 0.0, 0.5, 0.5], dtype=torch.float64)
    code = encode_boxes(box, bfov, box.size, HEIGHT)
    torch.testing.assert_close(code.delta, torch.tensor([0.2, 0.0], dtype=torch.float64))


def test_camera_height_of_each_box(generator: torch.Generator) -> None:
    boxes, bfov, mean_size = random_code_input(4, generator, torch.float64)
    heights = torch.tensor([1.0, 1.4, 1.6, 2.0], dtype=torch.float64)
    together = encode_boxes(boxes, bfov, mean_size, heights)
    for i, height in enumerate(heights.tolist()):
        alone = encode_boxes(boxes[i], bfov[i], mean_size[i], height)
        torch.testing.assert_close(alone.delta, together.delta[i])
        torch.testing.assert_close(alone.distance_residual, together.distance_residual[i])


def test_decoding_is_differentiable_in_every_residual(generator: torch.Generator) -> None:
    boxes, bfov, mean_size = random_code_input(6, generator, torch.float64)
    code = encode_boxes(boxes, bfov, mean_size, HEIGHT)

    def decode(
        delta: Tensor, distance: Tensor, yaw: Tensor, size: Tensor, bfov: Tensor
    ) -> tuple[Tensor, ...]:
        moved = BoxCode(delta, code.distance_bin, distance, code.yaw_bin, yaw, size)
        decoded = decode_box_code(moved, bfov, mean_size, HEIGHT)
        return decoded.centre, decoded.size, decoded.yaw

    residuals = (code.delta, code.distance_residual, code.yaw_residual, code.size_residual, bfov)
    torch.autograd.gradcheck(decode, tuple(r.clone().requires_grad_() for r in residuals))


def test_encoding_is_differentiable(generator: torch.Generator) -> None:
    boxes, bfov, mean_size = random_code_input(6, generator, torch.float64)

    def encode(centre: Tensor, size: Tensor, yaw: Tensor) -> tuple[Tensor, ...]:
        code = encode_boxes(OrientedBoxes(centre, size, yaw), bfov, mean_size, HEIGHT)
        return code.delta, code.distance_residual, code.yaw_residual, code.size_residual

    fields = (boxes.centre, boxes.size, boxes.yaw)
    torch.autograd.gradcheck(encode, tuple(f.clone().requires_grad_() for f in fields))


def test_no_boxes() -> None:
    none = OrientedBoxes(torch.zeros(0, 3), torch.zeros(0, 3), torch.zeros(0))
    bfov, mean_size = torch.zeros(0, 4), torch.zeros(0, 3)
    decoded = decode_box_code(encode_boxes(none, bfov, mean_size, HEIGHT), bfov, mean_size, HEIGHT)
    assert decoded.centre.shape == (0, 3)


def test_refusals(generator: torch.Generator) -> None:
    boxes, bfov, mean_size = random_code_input(3, generator, torch.float64)
    with pytest.raises(ValueError, match=r"mean_size: found 0\.0, expected"):
        encode_boxes(boxes, bfov, mean_size * 0, HEIGHT)
    with pytest.raises(ValueError, match="width and height of bfov"):
        encode_boxes(boxes, bfov * torch.tensor([1.0, 1.0, 0.0, 1.0]), mean_size, HEIGHT)
    at_camera = OrientedBoxes(torch.tensor([[0.0, 0.0, HEIGHT]] * 3), boxes.size, boxes.yaw)
    at_camera = OrientedBoxes(at_camera.centre.double(), boxes.size, boxes.yaw)
    with pytest.raises(ValueError, match="distance of the box centre from the camera"):
        encode_boxes(at_camera, bfov, mean_size, float(at_camera.centre[0, 2]))
    code = encode_boxes(boxes, bfov, mean_size, HEIGHT)
    wrong = BoxCode(
        code.delta,
        code.distance_bin + DISTANCE_BINS,
        code.distance_residual,
        code.yaw_bin,
        code.yaw_residual,
        code.size_residual,
    )
    with pytest.raises(ValueError, match=r"distance_bin: found .* expected 0 to 5"):
        decode_box_code(wrong, bfov, mean_size, HEIGHT)
