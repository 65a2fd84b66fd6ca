"""What geometry says of distances."""

import math

import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.geometry import OrientedBoxes, bfov_from_boxes
from panoscene.models.pose import CLUE_METRES, CLUES, GUESSES, pose_clues
from panoscene.scene import Layout

SQUARE = torch.tensor([[-2.0, -3.0], [2.0, -3.0], [2.0, 3.0], [-2.0, 3.0]])


def one(lon: float, lat: float, width: float = 0.2, height: float = 0.2) -> torch.Tensor:
    return torch.tensor([[lon, lat, width, height]])


def test_guesses_by_hand() -> None:
    down = -math.radians(30)
    clues = pose_clues(one(0.3, down), torch.tensor([[0.4, 0.6, 1.0]]), 1.6)
    guess = clues[0, :GUESSES] * CLUE_METRES
    across = 1.6 / math.tan(math.radians(30) + 0.1) + 0.3  # half of the depth behind the edge
    assert math.isclose(guess[0], math.hypot(across, 1.6 - 0.5), rel_tol=1e-5)
    assert math.isclose(guess[1], 3.2, rel_tol=1e-5)
    assert math.isclose(guess[2], 0.5 / math.tan(0.1), rel_tol=1e-5)
    assert math.isclose(guess[3], 0.25 / math.tan(0.1), rel_tol=1e-5)
    assert math.isclose(guess[4], (1.6 - 0.5) / 0.5, rel_tol=1e-5)
    assert torch.allclose(guess[5:], guess[0])


def test_room_clues_by_hand() -> None:
    layout = Layout(SQUARE, ceiling_height=2.6)
    ahead, right = pose_clues(
        torch.cat([one(0.0, 0.0), one(math.pi / 2, 0.0)]), torch.ones(2, 3), 1.6, layout
    )
    assert math.isclose(ahead[5] * CLUE_METRES, 3.0, rel_tol=1e-5)
    assert math.isclose(right[5] * CLUE_METRES, 2.0, rel_tol=1e-5)
    for clue in (ahead, right):  # an object against that wall faces the camera: -pi
        sine, cosine = clue[GUESSES + 12 : GUESSES + 14].tolist()
        assert math.isclose(cosine, -1.0, rel_tol=1e-4)
        assert abs(sine) < 1e-2
    assert ahead[-1] == 1.0


def test_no_layout_gives_zeros() -> None:
    clues = pose_clues(one(0.0, 0.0), torch.ones(1, 3), 1.6)
    assert clues.shape == (1, CLUES)
    assert bool((clues[0, -11:] == 0).all())
    assert pose_clues(torch.zeros(0, 4), torch.ones(0, 3), 1.6, Layout(SQUARE)).shape == (0, CLUES)


@settings(max_examples=25, deadline=None)
@given(
    lon=st.floats(-3.1, 3.1), lat=st.floats(-1.5, 1.5), width=st.floats(0.01, 3.1),
    height=st.floats(0.01, 3.1), turn=st.floats(-3.1, 3.1),
)  # fmt: skip
def test_turning_the_world_changes_nothing(
    lon: float, lat: float, width: float, height: float, turn: float
) -> None:
    size = torch.tensor([[0.5, 0.6, 0.7]], dtype=torch.float64)
    bfov = torch.tensor([[lon, lat, width, height]], dtype=torch.float64)
    square = SQUARE.double() + torch.tensor([0.3, 0.2])
    clues = pose_clues(bfov, size, 1.6, Layout(square))
    cos, sin = math.cos(turn), math.sin(turn)
    turned = square @ torch.tensor([[cos, sin], [-sin, cos]], dtype=torch.float64)
    moved = bfov - torch.tensor([[turn, 0.0, 0.0, 0.0]], dtype=torch.float64)
    again = pose_clues(moved, size, 1.6, Layout(turned))
    assert bool(clues.isfinite().all())
    # where a ray grazes a corner or an edge, rounding may choose the other side
    assert int(((clues - again).abs() > 1e-5).sum()) <= 6


@settings(max_examples=20, deadline=None)
@given(lon=st.floats(-3.0, 3.0), away=st.floats(1.5, 6.0))
def test_a_standing_box_of_mean_size_is_guessed(lon: float, away: float) -> None:
    size = torch.tensor([[0.4, 0.4, 0.8]])
    centre = torch.tensor([[math.sin(lon) * away, math.cos(lon) * away, 0.4]])
    boxes = OrientedBoxes(centre, size, torch.tensor([-lon]))
    clues = pose_clues(bfov_from_boxes(boxes, 1.6), size, 1.6)
    assert abs(float(clues[0, 0]) * CLUE_METRES - math.hypot(away, 1.2)) < 0.12
