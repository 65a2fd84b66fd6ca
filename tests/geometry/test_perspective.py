import math
from functools import partial
from typing import Any

import py360convert
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry._cube import CUBE_FACES, cube_from_panorama, panorama_from_cube
from panoscene.geometry._perspective import (
    MAX_FOV,
    panorama_from_perspective,
    perspective_crop,
    perspective_directions,
    pixel_in_perspective,
)
from panoscene.geometry._resample import panorama_directions
from panoscene.geometry._sphere import (
    camera_from_turned,
    lonlat_from_direction,
    pixel_from_direction,
)

from .conftest import noise, panorama, scene

gradcheck = partial(torch.autograd.gradcheck, fast_mode=True)
few = settings(max_examples=15, deadline=None)
angles = st.floats(-3.0, 3.0)


def test_the_crop_spans_the_bfov_exactly() -> None:
    bfov = torch.tensor([0.4, -0.3, 1.2, 0.6], dtype=torch.float64)
    direction = perspective_directions(bfov, (301, 501))
    torch.testing.assert_close(direction.norm(dim=-1), torch.ones(301, 501, dtype=torch.float64))
    lon, lat = lonlat_from_direction(direction @ camera_from_turned(bfov[:2])).unbind(-1)
    # outermost pixel centres are half a pixel inside the field of view
    inside_x, inside_z = math.tan(0.6) * (1 - 1 / 501), math.tan(0.3) * (1 - 1 / 301)
    assert float(lon[150].max()) == pytest.approx(math.atan(inside_x))
    assert float(lon[150].min()) == pytest.approx(-math.atan(inside_x))
    assert float(lat[0, 250]) == pytest.approx(math.atan(inside_z))
    assert float(lat[-1, 250]) == pytest.approx(-math.atan(inside_z))


@pytest.mark.parametrize(
    "view",
    [(0, 0, 90, 60), (30, 20, 75, 75), (-179, -35, 100, 50), (95, 85, 60, 90), (-60, -90, 40, 40)],
)
def test_crops_agree_with_py360convert(view: tuple[int, int, int, int]) -> None:
    """Its crops put the outermost pixel centres on the border, so the field of view differs.

    With n columns of ours between its first and last of 2 n + 1, each odd one is one of ours.
    Its bilinear look-up in the panorama has our convention, so even noise must agree.
    """
    image = noise(64, 128, 3)
    lon, lat, width, height = view
    theirs = py360convert.e2p(image.numpy(), (width, height), lon, lat, (2 * 24 + 1, 2 * 32 + 1))
    bfov = torch.tensor(view, dtype=torch.float64).deg2rad()
    ours = perspective_crop(image.permute(2, 0, 1), bfov, (24, 32))
    expected = torch.from_numpy(theirs[1::2, 1::2]).permute(2, 0, 1)
    # its single precision costs 1e-5 of a pixel; a tenth of a pixel would cost about 0.1
    torch.testing.assert_close(ours, expected, atol=2e-3, rtol=0)


@few
@given(angles, st.floats(-1.5, 1.5), st.floats(0.1, 2.4), st.floats(0.1, 2.4))
def test_crops_show_what_is_there(lon: float, lat: float, width: float, height: float) -> None:
    bfov = torch.tensor([lon, lat, width, height], dtype=torch.float64)
    crop = perspective_crop(panorama(96, 192), bfov, (12, 16))
    expected = scene(perspective_directions(bfov, (12, 16)))
    torch.testing.assert_close(crop, expected, atol=1e-3, rtol=0)


def test_many_crops_of_one_panorama_are_each_their_own() -> None:
    image, bfov = noise(3, 32, 64), noise(2, 3, 4, seed=4) + 0.2
    crops = perspective_crop(image, bfov, (5, 7))
    assert crops.shape == (2, 3, 3, 5, 7)
    torch.testing.assert_close(crops[1, 2], perspective_crop(image, bfov[1, 2], (5, 7)))
    assert perspective_crop(image, bfov[:0], (5, 7)).shape == (0, 3, 3, 5, 7)
    images = noise(2, 1, 3, 32, 64, seed=5)
    paired = perspective_crop(images, bfov, (5, 7))
    torch.testing.assert_close(paired[1, 0], perspective_crop(images[1, 0], bfov[1, 0], (5, 7)))


def test_a_crop_across_the_seam_is_the_crop_of_the_rolled_panorama() -> None:
    image = noise(3, 32, 64)
    seam = torch.tensor([math.pi - 0.05, 0.2, 1.0, 0.8], dtype=torch.float64)
    ahead = seam - torch.tensor([math.pi, 0, 0, 0], dtype=torch.float64)
    torch.testing.assert_close(
        perspective_crop(image, seam, (16, 16)),
        perspective_crop(image.roll(32, -1), ahead, (16, 16)),
    )


@pytest.mark.parametrize("degrees", [0.0, 1e-3, 149.9, 179.9, 180.0, 220.0, 360.0])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_any_field_of_view_is_safe(degrees: float, dtype: torch.dtype) -> None:
    fov = math.radians(degrees)
    bfov = torch.tensor([1.0, 0.3, fov, fov], dtype=dtype, requires_grad=True)
    crop = perspective_crop(panorama(32, 64, dtype), bfov, (9, 9))
    crop.sum().backward()
    assert bool(crop.isfinite().all())
    assert bfov.grad is not None
    assert bool(bfov.grad.isfinite().all())
    clamped = bfov.detach().clone()
    clamped[2:].clamp_(max=MAX_FOV)
    expected = scene(perspective_directions(clamped, (9, 9)))
    torch.testing.assert_close(crop.detach(), expected, atol=1e-2, rtol=0)
    painted, covered = panorama_from_perspective(crop, bfov, 32, 64)
    assert bool(painted.isfinite().all())
    assert bool(covered.any()) == (degrees > 1)
    aim = camera_from_turned(bfov.detach()[:2])[:, 1]
    uv, _ = pixel_in_perspective(aim, bfov, (9, 9))
    (gradient,) = torch.autograd.grad(uv.sum(), bfov)
    # a billionth of the view may be off by a thousandth of it in a pinhole of 1e-4 radians
    torch.testing.assert_close(uv.detach(), torch.full_like(uv, 4.5), atol=1e-2, rtol=0)
    assert bool(gradient.isfinite().all())


def test_perspectives_refuse_bad_sizes_and_clamps() -> None:
    bfov = torch.tensor([0.0, 0.0, 1.0, 1.0])
    for size in ((0, 4), (4, -1)):
        with pytest.raises(ValueError, match="size: found"):
            perspective_directions(bfov, size)
    for max_fov in (0.0, math.pi, math.nan):
        with pytest.raises(ValueError, match="max_fov: found"):
            perspective_directions(bfov, (4, 4), max_fov=max_fov)


@few
@given(angles, st.floats(-1.5, 1.5), st.floats(0.1, 3.5), st.floats(0.1, 3.5))
def test_pixels_and_directions_of_a_crop_invert(
    lon: float, lat: float, width: float, height: float
) -> None:
    bfov = torch.tensor([lon, lat, width, height], dtype=torch.float64)
    direction = perspective_directions(bfov, (6, 8))
    uv, inside = pixel_in_perspective(3.0 * direction, bfov, (6, 8))
    v, u = torch.meshgrid(torch.arange(6.0), torch.arange(8.0), indexing="ij")
    torch.testing.assert_close(uv, torch.stack((u, v), -1).double() + 0.5)
    assert bool(inside.all())
    behind, seen = pixel_in_perspective(-direction, bfov, (6, 8))
    assert bool(behind.isfinite().all())
    assert not bool(seen.any())


def test_pixel_in_perspective_has_the_right_gradient() -> None:
    direction = torch.tensor([[0.2, 1.0, 0.1], [0.5, 0.9, -0.4]], dtype=torch.float64)
    bfov = torch.tensor([0.1, 0.2, 1.1, 0.9], dtype=torch.float64)
    direction.requires_grad_()
    bfov.requires_grad_()
    assert gradcheck(lambda d, b: pixel_in_perspective(d, b, (6, 8))[0], (direction, bfov))
    assert gradcheck(
        lambda b: perspective_crop(panorama(8, 16), b, (2, 3)), (bfov.detach().requires_grad_(),)
    )


@pytest.mark.parametrize(
    "view", [(0.3, 0.2, 1.3, 1.0), (math.pi, -0.4, 1.5, 1.2), (0.5, math.pi / 2, 1.2, 1.4)]
)
def test_perspective_panorama_perspective_is_a_round_trip(view: tuple[float, ...]) -> None:
    bfov = torch.tensor(view, dtype=torch.float64)
    truth = panorama(128, 256)
    crop = perspective_crop(truth, bfov, (96, 96))
    painted, covered = panorama_from_perspective(crop, bfov, 128, 256)
    direction = panorama_directions(128, 256, like=bfov)
    turned = direction @ camera_from_turned(bfov[:2])
    seen = (turned[..., 1] > 0) & (
        (turned[..., [0, 2]] / turned[..., 1:2]).abs() <= (bfov[2:] / 2).tan()
    ).all(-1)
    assert torch.equal(covered, seen)
    assert bool((painted[:, ~covered] == 0).all())
    # half a pixel next to the crop's border is extrapolated: one part in 200 there
    torch.testing.assert_close(painted[:, covered], truth[:, covered], atol=8e-3, rtol=0)
    within = bfov * torch.tensor([1, 1, 0.9, 0.9])
    again = perspective_crop(painted, within, (64, 64))
    torch.testing.assert_close(
        again, scene(perspective_directions(within, (64, 64))), atol=2e-3, rtol=0
    )


def test_crops_are_painted_back_in_batches_with_gradients() -> None:
    crops, bfov = noise(2, 3, 8, 8), torch.tensor([[0.0, 0, 1, 1], [2.0, 0.5, 1, 1]])
    crops.requires_grad_()
    painted, covered = panorama_from_perspective(crops, bfov, 16, 32)
    assert painted.shape == (2, 3, 16, 32)
    alone, _ = panorama_from_perspective(crops[1], bfov[1], 16, 32)
    torch.testing.assert_close(painted[1], alone)
    (gradient,) = torch.autograd.grad(painted.sum(), crops)
    assert float(gradient.sum()) == pytest.approx(3 * int(covered.sum()))


def test_crops_of_40_megapixels_are_located_to_the_pixel_in_single_precision() -> None:
    image = torch.arange(9000, dtype=torch.int16).expand(1, 4500, 9000).contiguous()
    bfov = torch.tensor([[math.pi, 0.0, 1.0, 1.0], [1.0, 0.2, 0.1, 0.1]])
    crop = perspective_crop(image, bfov, (64, 64), mode="nearest")
    u = pixel_from_direction(perspective_directions(bfov, (64, 64)), 4500, 9000)[..., 0]
    assert float((crop[:, 0] + 0.5 - u).abs().max()) <= 0.51


# --- cube maps


def test_faces_look_where_they_say_and_meet_as_documented() -> None:
    towards = dict(zip(CUBE_FACES, cube_from_panorama(panorama(256, 512), 33), strict=True))
    axes = {"front": (0, 1, 0), "right": (1, 0, 0), "back": (0, -1, 0), "left": (-1, 0, 0)}
    axes |= {"up": (0, 0, 1), "down": (0, 0, -1)}
    for name, axis in axes.items():
        expected = scene(torch.tensor([[axis]], dtype=torch.float64))[:, 0, 0]
        torch.testing.assert_close(towards[name][:, 16, 16], expected, atol=1e-3, rtol=0)
    top, bottom, left, right = (..., 0, slice(None)), (..., -1, slice(None)), (..., 0), (..., -1)
    meetings: list[Any] = [("front", right, "right", left), ("right", right, "back", left)]
    meetings += [("back", right, "left", left), ("left", right, "front", left)]
    meetings += [("up", bottom, "front", top), ("front", bottom, "down", top)]
    for one, edge, other, other_edge in meetings:
        near, far = towards[one][edge], towards[other][other_edge]
        assert float((near - far).abs().max()) < 0.06  # one pixel of a face of 33
        assert float((near - far.flip(-1)).abs().max()) > 0.1


def test_cubes_agree_with_py360convert() -> None:
    """Its outermost pixel centres lie on the cube's edges: odd ones of 2 n + 1 are our n."""
    image = noise(64, 128, 3)
    theirs = py360convert.e2c(image.numpy(), face_w=2 * 16 + 1, cube_format="list")
    ours = cube_from_panorama(image.permute(2, 0, 1), 16)
    for name, face, expected in zip(CUBE_FACES, ours, theirs, strict=True):
        oracle = torch.from_numpy(expected[1::2, 1::2]).permute(2, 0, 1)
        torch.testing.assert_close(face, oracle, atol=2e-3, rtol=0, msg=f"face {name}")


def test_panorama_cube_panorama_is_a_round_trip_without_seams() -> None:
    truth = panorama(128, 256)
    back = panorama_from_cube(cube_from_panorama(truth, 64), 128, 256)
    # clamping at the faces' borders instead of asking the neighbour would cost 1e-2 there
    torch.testing.assert_close(back, truth, atol=2.5e-3, rtol=0)
    batch = panorama_from_cube(cube_from_panorama(torch.stack((truth, 1 - truth)), 32), 64, 128)
    assert batch.shape == (2, 3, 64, 128)
    torch.testing.assert_close(batch[0] + batch[1], torch.ones(3, 64, 128, dtype=torch.float64))


def test_cubes_carry_gradients() -> None:
    image = noise(1, 4, 8).requires_grad_()
    faces = noise(6, 1, 3, 3).requires_grad_()
    assert gradcheck(lambda i: cube_from_panorama(i, 2), image)
    assert gradcheck(lambda f: panorama_from_cube(f, 4, 8), faces)
