"""Mirrored, rolled and tilted panoramas: picture, labels and directions move together."""

import math

import pytest
import torch

from panoscene.data import Motion, random_motion, tilt_rotation
from panoscene.geometry import direction_from_pixel, pixel_from_direction

HEIGHT, WIDTH = 64, 128
MOTIONS = {
    "still": Motion(False, 0, WIDTH),
    "mirror": Motion(True, 0, WIDTH),
    "roll": Motion(False, 37, WIDTH),
    "both": Motion(True, 100, WIDTH),
    "tilt": Motion(False, 11, WIDTH, tilt_rotation(0.3, 1.0)),
    "all": Motion(True, 60, WIDTH, tilt_rotation(0.2, -2.0)),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_labels_go_where_directions_go(name: str) -> None:
    motion = MOTIONS[name]
    rows, columns = torch.tensor([20, 30, 45]), torch.tensor([5, 64, 127])
    labels = torch.zeros(HEIGHT, WIDTH, dtype=torch.int64)
    image = torch.zeros(3, HEIGHT, WIDTH)
    for k, (row, column) in enumerate(zip(rows.tolist(), columns.tolist(), strict=True)):
        around = torch.arange(column - 2, column + 3) % WIDTH
        labels[row - 2 : row + 3, around] = k + 1
        image[k, row - 2 : row + 3, around] = 1.0
    uv = torch.stack((columns + 0.5, rows + 0.5), -1).double()
    directions = direction_from_pixel(uv, HEIGHT, WIDTH)
    moved = pixel_from_direction(motion.directions(directions), HEIGHT, WIDTH)
    found, picture = motion.labels(labels), motion.image(image)
    assert found.dtype == torch.int64
    for k, (u, v) in enumerate(moved.tolist()):
        row, column = int(v), int(u) % WIDTH
        assert found[row, column] == k + 1
        assert picture[k, row, column] > 0.9


@pytest.mark.parametrize("name", ["still", "mirror", "roll", "both"])
def test_without_tilt_every_pixel_is_kept(generator: torch.Generator, name: str) -> None:
    image = torch.rand(3, HEIGHT, WIDTH, generator=generator)
    moved = MOTIONS[name].image(image)
    assert torch.equal(moved.sort(dim=-1).values, image.sort(dim=-1).values)


def test_matrices_are_rotations_or_mirrors() -> None:
    for motion in MOTIONS.values():
        matrix = motion.new_from_old
        torch.testing.assert_close(matrix @ matrix.T, torch.eye(3, dtype=torch.float64))
        assert round(float(matrix.det())) == (-1 if motion.mirror else 1)


def test_tilt_lowers_what_is_in_front() -> None:
    for lon in (-2.0, 0.0, 1.0):
        ahead = torch.tensor([math.sin(lon), math.cos(lon), 0.0], dtype=torch.float64)
        moved = tilt_rotation(0.25, lon) @ ahead
        assert math.asin(float(moved[2])) == pytest.approx(-0.25)


def test_random_motions() -> None:
    motions = [
        random_motion(WIDTH, torch.Generator().manual_seed(k), step=32, tilt=0.1, tilted=0.5)
        for k in range(60)
    ]
    assert {motion.columns for motion in motions} == {0, 32, 64, 96}
    assert 15 < sum(motion.mirror for motion in motions) < 45
    tilts = [motion.tilt for motion in motions if motion.tilt is not None]
    assert 15 < len(tilts) < 45
    angles = [math.acos(min(1.0, float(tilt[2, 2]))) for tilt in tilts]
    assert 0.0 < max(angles) <= 0.1 + 1e-9
    again = random_motion(WIDTH, torch.Generator().manual_seed(3), step=32)
    assert again == random_motion(WIDTH, torch.Generator().manual_seed(3), step=32)


def test_wrong_sizes() -> None:
    with pytest.raises(ValueError, match="step: found 30"):
        random_motion(WIDTH, torch.Generator(), step=30)
    with pytest.raises(ValueError, match="found 64 columns, expected 128"):
        MOTIONS["roll"].image(torch.zeros(3, 32, 64))
