"""Split a panorama's columns into walls: an optimal segmentation by dynamic programming.

The inverse of the horizontal distance is what makes this simple. A wall is a line m . p = 1 on
the floor, and the ray along the unit vector r meets it where 1 / distance = m . r: linear in the
wall, for any wall. Fitting a wall to a run of columns is therefore linear least squares, its
residual is (to first order) an error of latitude, and both follow from running sums over columns.
A wall of a Manhattan room has m along one of two axes, one number to fit.
"""

from dataclasses import dataclass

import torch
from jaxtyping import Float, Int64
from torch import Tensor

LARGE = 1e9
"""Cost of a run of columns that no wall in front of the camera explains."""
WIDEST = 2.9
"""Largest angle in radians that one wall may span; a wall seen from inside spans less than pi."""


@dataclass(frozen=True, slots=True)
class Run:
    """A run of columns that one wall explains."""

    first: int
    """First column, counted from the start of the columns."""
    end: int
    """One past the last column."""
    moment: Float[Tensor, "2 2"]
    pull: Float[Tensor, "2"]
    energy: float


def column_sums(
    ray: Float[Tensor, "columns 2"],
    nearness: Float[Tensor, " columns"],
    weight: Float[Tensor, " columns"],
) -> Float[Tensor, "6 columns_and_1"]:
    """Return running sums over columns, from which the fit of a wall to any run follows.

    Entry k sums the first k columns. The rows: weighted x x, x y and y y of the ray r = (x, y),
    its x and y times the nearness, and the nearness squared.

    Args:
        ray: Unit vector on the floor of each column.
        nearness: Inverse horizontal distance to the wall in 1 / metres.
        weight: Inverse variance of the nearness.

    Examples:
        >>> column_sums(torch.eye(2), torch.ones(2), torch.ones(2))[5]
        tensor([0., 1., 2.])
    """
    x, y = ray.unbind(-1)
    each = torch.stack((x * x, x * y, y * y, x * nearness, y * nearness, nearness**2)) * weight
    return torch.cat((torch.zeros_like(each[:, :1]), each.cumsum(1)), dim=1)


def run_of(sums: Float[Tensor, "6 columns_and_1"], first: int, end: int) -> Run:
    """Return the run of columns from ``first`` up to ``end``.

    Examples:
        >>> sums = column_sums(torch.eye(2), torch.ones(2), torch.ones(2))
        >>> run_of(sums, 1, 2).energy
        1.0
    """
    total = sums[:, end] - sums[:, first]
    moment = total[[0, 1, 1, 2]].reshape(2, 2)
    return Run(first, end, moment, total[3:5], float(total[5]))


def general_costs(
    sums: Float[Tensor, "6 columns_and_1"], nodes: Int64[Tensor, " nodes"], ray: Tensor
) -> Float[Tensor, "nodes nodes"]:
    """Return the misfit of the best line to the columns between every two nodes.

    Entry [i, j] belongs to the columns from nodes[i] up to nodes[j]; it is ``LARGE`` when i >= j,
    when the run is wider than a wall can be, or when the line passes behind the camera.
    """
    xx, xy, yy, x_pull, y_pull, energy = _between(sums, nodes)
    x, y = _solve(xx, xy, yy, x_pull, y_pull)
    facing = _facing(x, y, nodes, ray)
    return _forbid(energy - x * x_pull - y * y_pull, nodes, len(ray), facing)


def manhattan_costs(
    sums: Float[Tensor, "6 columns_and_1"],
    nodes: Int64[Tensor, " nodes"],
    ray: Float[Tensor, "columns 2"],
    axes: Float[Tensor, "2 2"],
) -> Float[Tensor, "2 nodes nodes"]:
    """Return the misfit of the best wall across each of two axes between every two nodes."""
    xx, xy, yy, x_pull, y_pull, energy = _between(sums, nodes)
    costs: list[Tensor] = []
    for axis in axes:
        a, b = float(axis[0]), float(axis[1])
        pull = a * x_pull + b * y_pull
        spread = (a * a * xx + 2 * a * b * xy + b * b * yy).clamp_(min=1e-12)
        line = pull / spread
        facing = _facing(a * line, b * line, nodes, ray)
        costs.append(_forbid(energy - pull * line, nodes, len(ray), facing))
    return torch.stack(costs)


def fit_line(run: Run) -> Float[Tensor, "2"]:
    """Return the line m (m . p = 1) that fits a run of columns best."""
    return torch.stack(_solve(*run.moment.flatten()[[0, 1, 3]], *run.pull))


def fit_across(run: Run, axis: Float[Tensor, "2"]) -> tuple[Float[Tensor, "2"], float]:
    """Return the best line across ``axis`` for a run of columns, and its misfit."""
    along = axis @ run.pull
    spread = (axis @ run.moment @ axis).clamp(min=1e-12)
    return along / spread * axis, run.energy - float(along**2 / spread)


def cheapest_path(
    cost: Float[Tensor, "nodes nodes"], toll: Float[Tensor, " nodes"]
) -> list[tuple[int, int]]:
    """Return the runs (from node, to node) from the first to the last node of least total cost.

    Each run pays its cost and the toll of the node at which it ends.

    Examples:
        >>> cost = torch.tensor([[9.0, 1.0, 5.0], [9.0, 9.0, 1.0], [9.0, 9.0, 9.0]])
        >>> cheapest_path(cost, torch.tensor([0.0, 1.0, 0.0]))
        [(0, 1), (1, 2)]
    """
    count = len(toll)
    # column-wise, so that each step reads memory in order
    into = (cost + toll).T.contiguous()
    best = torch.zeros(count, dtype=cost.dtype)
    before = [0] * count
    for node in range(1, count):
        total = best[:node] + into[node, :node]
        value, index = total.min(0)
        best[node] = value
        before[node] = int(index)
    runs: list[tuple[int, int]] = []
    node = count - 1
    while node > 0:
        runs.append((before[node], node))
        node = before[node]
    return runs[::-1]


def manhattan_axes(runs: list[Run], *, steps: int = 90) -> Float[Tensor, "2 2"]:
    """Return two perpendicular unit vectors along which the walls of these runs look best.

    A search over the quarter turn, refined twice; the misfit of each run is capped at what an
    oblique wall would give, so that single oblique walls do not turn the room.
    """
    moment = torch.stack([run.moment for run in runs])
    pull = torch.stack([run.pull for run in runs])
    xx, xy, yy = moment[:, 0, 0], moment[:, 0, 1], moment[:, 1, 1]
    x, y = _solve(xx, xy, yy, pull[:, 0], pull[:, 1])
    free = x * pull[:, 0] + y * pull[:, 1]
    quarter = torch.pi / 2
    angle, reach = pull.new_tensor(quarter / 2), quarter / 2
    for _ in range(3):
        angles = angle + torch.linspace(-reach, reach, steps, dtype=pull.dtype)
        angle = angles[_turned_gain(angles, moment, pull, free).argmax()]
        reach = 2 * reach / steps
    cos, sin = torch.cos(angle), torch.sin(angle)
    return torch.stack((torch.stack((cos, sin)), torch.stack((-sin, cos))))


def _turned_gain(angles: Tensor, moment: Tensor, pull: Tensor, free: Tensor) -> Tensor:
    """Return how well walls across axes turned by each angle explain all runs."""
    gains: list[Tensor] = []
    for turn in (0.0, torch.pi / 2):
        axis = torch.stack((torch.cos(angles + turn), torch.sin(angles + turn)), dim=-1)
        along = axis @ pull.T
        spread = torch.einsum("ai,kij,aj->ak", axis, moment, axis).clamp(min=1e-12)
        gains.append(along**2 / spread)
    loss = (free - torch.maximum(gains[0], gains[1])).clamp(min=0)
    cap = 0.02 * free.clamp(min=1e-12)
    return -(loss * cap / (loss + cap)).sum(-1)


def _between(sums: Tensor, nodes: Tensor) -> tuple[Tensor, ...]:
    """Return the six sums over the columns between every two nodes."""
    at = sums[:, nodes]
    return (at[:, None, :] - at[:, :, None]).unbind()


def _solve(
    xx: Tensor, xy: Tensor, yy: Tensor, x_pull: Tensor, y_pull: Tensor
) -> tuple[Tensor, Tensor]:
    """Return x and y of the least-squares lines; a little ridge keeps very short runs finite."""
    ridge = 1e-9 * (xx + yy).abs() + 1e-30
    xx, yy = xx + ridge, yy + ridge
    scale = 1 / (xx * yy - xy * xy).clamp(min=1e-60)
    return (yy * x_pull - xy * y_pull) * scale, (xx * y_pull - xy * x_pull) * scale


def _facing(x: Tensor, y: Tensor, nodes: Tensor, ray: Tensor) -> Tensor:
    """Return whether each line is in front of the camera at both ends of its run."""
    first_x, first_y = ray[nodes % len(ray)].unbind(-1)
    last_x, last_y = ray[(nodes - 1) % len(ray)].unbind(-1)
    starts = x * first_x[:, None] + y * first_y[:, None] > 0
    return starts & (x * last_x + y * last_y > 0)


def _forbid(misfit: Tensor, nodes: Tensor, columns: int, facing: Tensor) -> Tensor:
    span = nodes[None] - nodes[:, None]
    allowed = (span > 0) & (span <= WIDEST / (2 * torch.pi) * columns) & facing
    return torch.where(allowed, misfit.clamp(min=0), LARGE)
