"""What each column of the boundary signals says: how near the wall is, how sure, and corners."""

import math
from dataclasses import dataclass

import torch
from jaxtyping import Float, Int64
from torch import Tensor

from panoscene.geometry._boundary import CORNER_DECAY, column_lon

MIN_DISTANCE = 0.2
"""Metres: no wall is taken to be nearer to the camera."""
HEIGHT_RANGE = (0.2, 10.0)
"""Ceiling above the camera, as multiples of the camera's height."""
USUAL_HEIGHT = 0.6
"""The same, when the signals do not tell (2.56 m above the floor for a camera at 1.6 m)."""
LEAST_NOISE = math.radians(0.5)
"""Latitude error that is always allowed for."""
COUNTED_COLUMNS = 128
"""Errors of neighbouring columns go together: this many columns count as independent."""
MOST_JUMPS = 32
PEAK_THRESHOLD = 0.05
PEAK_WINDOW = 0.0125
"""Half the window of a corner peak, as a part of the width."""


@dataclass(frozen=True, slots=True)
class Columns:
    """The signals of a panorama, column by column, in float64 on the CPU."""

    ceiling_lat: Float[Tensor, " width"]
    floor_lat: Float[Tensor, " width"]
    ray: Float[Tensor, "width 2"]
    """Unit vector on the floor."""
    nearness: Float[Tensor, " width"]
    """Inverse distance of the wall in 1 / metres, from both boundaries."""
    weight: Float[Tensor, " width"]
    """Half the inverse variance of the nearness: misfits are in nats."""
    peak: Int64[Tensor, " peaks"]
    """Columns where the corner signal peaks."""
    peak_lon: Float[Tensor, " peaks"]
    """Their longitude in radians, finer than a column."""
    peak_probability: Float[Tensor, " peaks"]
    jump: Int64[Tensor, " jumps"]
    """Columns that see a much nearer or farther wall than the one before."""
    camera_height: float
    above_camera: float
    """Metres from the camera to the ceiling."""
    max_distance: float


def columns_from_signals(
    ceiling_lat: Float[Tensor, " width"],
    floor_lat: Float[Tensor, " width"],
    corner_probability: Float[Tensor, " width"],
    camera_height: float,
    max_distance: float,
) -> Columns:
    """Return the distance that each column implies, its certainty, and the corner peaks."""
    ceiling, floor = (part.detach().to("cpu", torch.float64) for part in (ceiling_lat, floor_lat))
    limit = math.pi / 2 - 1e-3
    rise, fall = torch.tan(ceiling.clamp(0, limit)), torch.tan((-floor).clamp(0, limit))
    above = _above_camera(rise, fall, camera_height, max_distance)
    nearest, farthest = 1 / MIN_DISTANCE, 1 / max_distance
    from_floor = (fall / camera_height).clamp(farthest, nearest)
    from_ceiling = (rise / above).clamp(farthest, nearest)
    # change of latitude with nearness: the precision of each boundary
    floor_weight = (camera_height / (1 + (camera_height * from_floor) ** 2)) ** 2
    ceiling_weight = (above / (1 + (above * from_ceiling) ** 2)) ** 2
    total = floor_weight + ceiling_weight
    noise = torch.maximum(_noise(ceiling), _noise(floor)).clamp(min=LEAST_NOISE)
    lon = column_lon(len(floor), dtype=torch.float64)
    probability = corner_probability.detach().to("cpu", torch.float64).clamp(0, 1)
    peak, peak_lon = corner_peaks(probability)
    return Columns(
        ceiling_lat=ceiling,
        floor_lat=floor,
        ray=torch.stack((torch.sin(lon), torch.cos(lon)), dim=-1),
        nearness=(floor_weight * from_floor + ceiling_weight * from_ceiling) / total,
        weight=total * (COUNTED_COLUMNS / (2 * len(floor))) / noise**2,
        peak=peak,
        peak_lon=peak_lon,
        peak_probability=probability[peak],
        jump=_jumps(ceiling, floor, 4 * float(noise)),
        camera_height=camera_height,
        above_camera=above,
        max_distance=max_distance,
    )


def corner_peaks(
    probability: Float[Tensor, " width"],
) -> tuple[Int64[Tensor, " peaks"], Float[Tensor, " peaks"]]:
    """Return the columns of the peaks of a corner signal and their longitudes in radians.

    A peak is the largest value within a window around the seam, above a threshold; the first
    column of a plateau, and none in a constant signal. Its longitude follows from the slopes on
    both sides, since the logarithm of the signal falls linearly from a corner.

    Examples:
        >>> from panoscene.geometry._boundary import corner_signal_from_layout
        >>> room = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]]).double()
        >>> corner_peaks(corner_signal_from_layout(room, 512))[1] * 4 / torch.pi
        tensor([-3., -1.,  1.,  3.], dtype=torch.float64)
    """
    width = len(probability)
    reach = max(round(PEAK_WINDOW * width), 1)
    padded = torch.cat((probability[-reach:], probability, probability[:reach]))
    highest = torch.nn.functional.max_pool1d(padded[None, None], 2 * reach + 1, stride=1)[0, 0]
    before, after = probability.roll(1), probability.roll(-1)
    is_peak = (probability >= highest) & (probability > before) & (probability > PEAK_THRESHOLD)
    peak = torch.nonzero(is_peak)[:, 0]
    slope = torch.log(after[peak].clamp(min=1e-6)) - torch.log(before[peak].clamp(min=1e-6))
    shift = (slope / (-2 * math.log(CORNER_DECAY))).clamp(-0.5, 0.5)
    return peak, ((peak + 0.5 + shift) / width - 0.5) * (2 * math.pi)


def _above_camera(
    rise: Float[Tensor, " width"],
    fall: Float[Tensor, " width"],
    camera_height: float,
    max_distance: float,
) -> float:
    """Return the height of the ceiling above the camera: the mean of the middle half of columns."""
    lowest = camera_height / max_distance
    usable = (fall > lowest) & (rise > lowest / 10)
    ratio = rise[usable] / fall[usable]
    if len(ratio) < len(rise) // 8:
        return USUAL_HEIGHT * camera_height
    ratio = ratio.sort().values
    middle = ratio[len(ratio) // 4 : max(3 * len(ratio) // 4, len(ratio) // 4 + 1)]
    return camera_height * min(max(float(middle.mean()), HEIGHT_RANGE[0]), HEIGHT_RANGE[1])


def _noise(lat: Float[Tensor, " width"]) -> Float[Tensor, ""]:
    """Return a robust standard deviation of independent noise, from second differences."""
    bend = lat - (lat.roll(1) + lat.roll(-1)) / 2
    return bend.abs().median() / (0.6745 * math.sqrt(1.5))


def _jumps(
    ceiling_lat: Float[Tensor, " width"], floor_lat: Float[Tensor, " width"], least: float
) -> Int64[Tensor, " jumps"]:
    """Return the columns with the largest change from the column before, among neighbours."""
    change = (ceiling_lat - ceiling_lat.roll(1)).abs() + (floor_lat - floor_lat.roll(1)).abs()
    largest = torch.maximum(change.roll(1), change.roll(-1))
    found = torch.nonzero((change > largest) & (change > 2 * least))[:, 0]
    return found[change[found].argsort(descending=True)[:MOST_JUMPS]]
