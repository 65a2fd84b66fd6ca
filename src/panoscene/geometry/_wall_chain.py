"""Walls around the camera in the order in which it sees them, and the corners between them."""

import math
from dataclasses import dataclass, replace

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry._boundary_columns import MIN_DISTANCE, Columns
from panoscene.geometry._wall_segmentation import (
    Run,
    cheapest_path,
    column_sums,
    fit_across,
    fit_line,
    general_costs,
    manhattan_costs,
    run_of,
)

NODES = 128
"""Places around the camera where walls may meet, besides corner peaks and jumps."""
TOLL = 4.0
"""Price of one more wall in nats where nothing indicates a corner."""
PEAK_TOLL = 0.5
"""Price where the corner signal is certain."""
NO_JUMP = 0.03
"""Two general walls that are this near (part of the distance) along a ray meet on it."""
SAME = 0.01
"""Corners nearer than this (metres) become one, and a corner this near to the line between its
neighbours is left out."""


@dataclass(frozen=True, slots=True)
class Wall:
    """One wall that the camera sees."""

    run: Run
    line: complex
    """m of the wall's line m . p = 1, as x + iy like all single vectors in this file."""
    axis: int
    """Which of two perpendicular axes the wall lies across; -1 for a general wall."""
    column: int
    """First column of the wall in the panorama."""
    ray: complex
    """Unit vector on the floor towards the end of the wall at smaller lon."""


def general_chain(columns: Columns) -> list[Wall]:
    """Return the walls of any direction that explain the columns best, clockwise."""
    start = 0
    if len(columns.peak):
        start = int(_peak_edges(columns)[columns.peak_probability.argmax()])
    turned = _turned(columns, start)
    path = cheapest_path(general_costs(turned.sums, turned.nodes, turned.ray), turned.toll)
    runs = [run_of(turned.sums, int(turned.nodes[i]), int(turned.nodes[j])) for i, j in path]
    runs = _moved_ends(runs, [fit_line(run) for run in runs], turned)
    return [_wall(run, fit_line(run), -1, turned) for run in runs]


def manhattan_chain(
    columns: Columns, general: list[Wall], axes: Float[Tensor, "2 2"]
) -> list[Wall]:
    """Return the walls across one of two axes that explain the columns best, clockwise.

    Starts where two wide general walls meet, which is surely the end of a wall.
    """
    widths = [wall.run.end - wall.run.first for wall in general]
    index = max(range(len(general)), key=lambda k: min(widths[k], widths[k - 1]))
    turned = _turned(columns, general[index].column)
    cost, choice = manhattan_costs(turned.sums, turned.nodes, turned.ray, axes).min(0)
    path = cheapest_path(cost, turned.toll)
    across = [int(choice[i, j]) for i, j in path]
    runs = [run_of(turned.sums, int(turned.nodes[i]), int(turned.nodes[j])) for i, j in path]
    lines = [fit_across(run, axes[axis])[0] for run, axis in zip(runs, across, strict=True)]
    runs = _moved_ends(runs, lines, turned)
    lines = [fit_across(run, axes[axis])[0] for run, axis in zip(runs, across, strict=True)]
    walls = [_wall(*parts, turned) for parts in zip(runs, lines, across, strict=True)]
    return _joined_at_start(walls, axes)


def chain_corners(
    chain: list[Wall],
    columns: Columns,
    slack: float,
    axes: Float[Tensor, "2 2"] | None = None,
) -> Float[Tensor, "corners 2"]:
    """Return the corners of a chain of walls, counter-clockwise.

    Two walls meet where their lines cross if that is within ``slack`` radians of the ray between
    them. Otherwise the nearer wall hides something. What is hidden is closed with walls across
    the axes, or without axes by a wall along the ray.
    """
    corners: list[complex] = []
    for previous, wall in zip([chain[-1], *chain[:-1]], chain, strict=True):
        crossing = _crossing(previous.line, wall.line)
        seen = crossing * wall.ray.conjugate()
        near_ray = seen.real > 0 and abs(seen.imag) <= slack * abs(crossing)
        if near_ray and abs(crossing) <= 1.5 * columns.max_distance:
            corners.append(crossing)
        else:
            corners += _hidden_corners(previous, wall, columns, axes)
    corners = _tidied(corners[::-1])
    return columns.ray.new_tensor([(corner.real, corner.imag) for corner in corners])


def _hidden_corners(
    previous: Wall, wall: Wall, columns: Columns, axes: Float[Tensor, "2 2"] | None
) -> list[complex]:
    """Return the corners that lead from one wall to the next along the ray between them."""
    before, after = (
        wall.ray * min(max(1 / max(dot(line, wall.ray), 1e-9), MIN_DISTANCE), columns.max_distance)
        for line in (previous.line, wall.line)
    )
    if axes is None:
        if abs(before - after) < NO_JUMP * abs(before):
            return [(before + after) / 2]
        return [before, after]
    across = _complex(axes[previous.axis])
    along = 1j * across
    if previous.axis != wall.axis:
        return [before, dot(after, across) * across + dot(before, along) * along, after]
    if abs(before) < abs(after):
        return [before, dot(after, across) * across + dot(before, along) * along]
    return [dot(before, across) * across + dot(after, along) * along, after]


@dataclass(frozen=True, slots=True)
class _Turned:
    """Columns counted from a chosen one, with the places where walls may end."""

    start: int
    ray: Tensor
    nearness: Tensor
    weight: Tensor
    sums: Tensor
    nodes: Tensor
    toll: Tensor
    peaks: dict[int, float]
    """Longitude of the corner peak at each column edge that has one."""


def _turned(columns: Columns, start: int) -> _Turned:
    """Return the columns counted from ``start``, which must be where a wall ends."""
    ray, nearness, weight = (
        part.roll(-start, dims=0) for part in (columns.ray, columns.nearness, columns.weight)
    )
    width = len(nearness)
    edges = (_peak_edges(columns) - start) % width
    step = max(width // NODES, 1)
    regular = torch.arange(0, width, step)
    jumps = (columns.jump - start) % width
    is_node = torch.zeros(width + 1, dtype=torch.bool)
    is_node[torch.cat((regular, edges, jumps, torch.tensor([width])))] = True
    nodes = torch.nonzero(is_node)[:, 0]
    toll = torch.full((width + 1,), TOLL, dtype=ray.dtype)
    toll[edges] = PEAK_TOLL + (TOLL - PEAK_TOLL) * (1 - columns.peak_probability)
    toll[-1] = 0
    return _Turned(
        start=start,
        ray=ray,
        nearness=nearness,
        weight=weight,
        sums=column_sums(ray, nearness, weight),
        nodes=nodes,
        toll=toll[nodes],
        peaks={int(edges[k]): float(columns.peak_lon[k]) for k in range(len(edges))},
    )


def _peak_edges(columns: Columns) -> Tensor:
    """Return how many column centres lie left of each corner peak."""
    width = len(columns.nearness)
    u = (columns.peak_lon / (2 * math.pi) + 0.5) * width
    return (u - 0.5).ceil().long() % width


def _moved_ends(runs: list[Run], lines: list[Tensor], turned: _Turned) -> list[Run]:
    """Return the runs with each end that is not a corner peak moved to the best column nearby."""
    reach = max(3 * len(turned.nearness) // (2 * NODES), 1)
    ends = [run.end for run in runs]
    for k in range(len(runs) - 1):
        if ends[k] in turned.peaks:
            continue
        low = max(runs[k].first + 1, ends[k] - reach)
        high = min(runs[k + 1].end - 1, ends[k] + reach)
        if low >= high:
            continue
        ray, nearness = turned.ray[low:high], turned.nearness[low:high]
        misfit = turned.weight[low:high] * (
            (nearness - ray @ lines[k]) ** 2 - (nearness - ray @ lines[k + 1]) ** 2
        )
        total = torch.cat((misfit.new_zeros(1), misfit.cumsum(0)))
        ends[k] = low + int(total.argmin())
    firsts = [runs[0].first, *ends[:-1]]
    if any(end <= first for first, end in zip(firsts, ends, strict=True)):
        return runs
    return [run_of(turned.sums, first, end) for first, end in zip(firsts, ends, strict=True)]


def _wall(run: Run, line: Tensor, axis: int, turned: _Turned) -> Wall:
    width = len(turned.nearness)
    column = (turned.start + run.first) % width
    lon = turned.peaks.get(run.first, (column / width - 0.5) * 2 * math.pi)
    ray = complex(math.sin(lon), math.cos(lon))
    return Wall(run, _complex(line), axis, column, ray)


def _joined_at_start(walls: list[Wall], axes: Float[Tensor, "2 2"]) -> list[Wall]:
    """Return the chain with its last and first wall made one when they are the same wall."""
    last, first = walls[-1], walls[0]
    if len(walls) < 5 or last.axis != first.axis:
        return walls
    joined = Run(
        last.run.first,
        last.run.end + first.run.end,
        last.run.moment + first.run.moment,
        last.run.pull + first.run.pull,
        last.run.energy + first.run.energy,
    )
    axis = axes[last.axis]
    line, misfit = fit_across(joined, axis)
    apart = fit_across(last.run, axis)[1] + fit_across(first.run, axis)[1]
    if misfit - apart > TOLL:
        return walls
    return [*walls[1:-1], replace(last, run=joined, line=_complex(line))]


def _complex(vector: Float[Tensor, "2"]) -> complex:
    return complex(float(vector[0]), float(vector[1]))


def dot(a: complex, b: complex) -> float:
    """Return the scalar product of two vectors of the floor."""
    return a.real * b.real + a.imag * b.imag


def _crossing(line: complex, other: complex) -> complex:
    """Return where two lines cross; far away when they are parallel."""
    determinant = line.real * other.imag - line.imag * other.real
    return 1j * (line - other) / (determinant if abs(determinant) > 1e-12 else 1e-12)


def _tidied(corners: list[complex]) -> list[complex]:
    """Return the corners without those that lie on a neighbour or between their neighbours."""
    kept = list(corners)
    index = 0
    while len(kept) > 3 and index < len(kept):
        corner = kept[index]
        to, onwards = corner - kept[index - 1], kept[(index + 1) % len(kept)] - corner
        aside = abs((to.conjugate() * onwards).imag)
        straight = dot(to, onwards) >= 0 and aside < SAME * abs(to + onwards) / 2
        if abs(to) < SAME or straight:
            kept.pop(index)
            index = max(index - 1, 0)
        else:
            index += 1
    return kept
