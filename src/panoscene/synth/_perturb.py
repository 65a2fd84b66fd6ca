"""Scenes as an imperfect network would estimate them."""

from dataclasses import dataclass, fields, replace

import numpy as np
import shapely
import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.geometry import (
    OrientedBoxes,
    camera_from_turned,
    direction_from_lonlat,
    lonlat_from_direction,
    polygon_problem,
    view_relative_yaw,
    wall_normals,
    yaw_from_view_relative,
)
from panoscene.scene import Layout, Objects, Scene


@dataclass(frozen=True, slots=True)
class PerturbNoise:
    """How wrong an estimate is; all numbers are standard deviations unless they say otherwise.

    The defaults are errors of the size that networks make on rooms like these: enough that boxes
    collide, float and leave the room, not so much that an object cannot be recognised.
    """

    direction: float = 0.02
    """Radians, in each of the two directions across the line of sight, by which the box centre's
    viewing direction is wrong."""
    distance: float = 0.08
    """Standard deviation of log(estimated / true distance from the camera)."""
    size: float = 0.10
    """Standard deviation of log(estimated / true size), for each axis on its own."""
    yaw: float = 0.209
    """Radians (12 degrees) by which the yaw relative to the line of sight is wrong."""
    flip: float = 0.02
    """Probability that the yaw is off by another quarter turn, to either side."""
    layout: float = 0.0
    """Metres by which every wall is moved along its normal, and the ceiling up or down."""
    bfov: float = 0.02
    """By how much each edge of the BFoV is off, as a share of the BFoV's width or height."""

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            if not (np.isfinite(value) and value >= 0.0):
                raise ValueError(f"{item.name} must be finite and not negative, found {value}")
        if self.flip > 1.0:
            raise ValueError(f"flip is a probability, found {self.flip}")


def perturb_scene(
    scene: Scene, rng: np.random.Generator, noise: PerturbNoise | None = None
) -> Scene:
    """Return the scene as estimated with errors: boxes, scores, BFoVs and, if asked for, layout.

    Errors are made where networks make them, in the viewing parametrisation: direction of the
    centre, distance along it, size, and yaw relative to the line of sight. So an error in the
    direction also turns the box in the world (yaw = wrap(-lon - theta) with the relative yaw
    theta kept), and an error in the distance moves it along its ray.

    Scores fall with the error, as those of a network that knows roughly when it is wrong:
    ``logit(score) = 3 - 1.2 z + e`` with e ~ N(0, 0.8), where z is the error over its standard
    deviation, at most 4. For ``distance_score`` that is the error of the log distance, for
    ``yaw_score`` that of the yaw including a quarter-turn flip, for ``score`` the largest of the
    three errors of the log size. Mean scores are 0.94 at z = 0, 0.83 at z = 1, 0.63 at z = 2 and
    0.17 at z = 4. An error whose noise is 0 counts as z = 0.

    The BFoV is what the image shows and stays the true one, but for a small jitter of its edges;
    it does not follow the wrong box. Categories, ids, shapes and ``relations`` are kept: object
    and wall indices stay valid, and the true relations are what an errorless relation network
    would say (``corrupt_relations`` makes worse ones).

    Args:
        scene: the true scene.
        rng: source of randomness; always the same number of draws for the same shapes.
        noise: how wrong; the defaults of ``PerturbNoise`` when omitted.

    Examples:
        >>> from panoscene.synth import sample_room
        >>> room = sample_room(np.random.default_rng(0), objects=3)
        >>> same = perturb_scene(
        ...     room, np.random.default_rng(1), PerturbNoise(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        ... )
        >>> bool((same.objects.boxes.centre - room.objects.boxes.centre).abs().max() < 1e-5)
        True
    """
    noise = PerturbNoise() if noise is None else noise
    objects = _perturb_objects(scene.objects, scene.panorama.camera_height, rng, noise)
    layout = _perturb_layout(scene.layout, rng, noise.layout)
    return replace(scene, objects=objects, layout=layout)


def _perturb_objects(
    objects: Objects, camera_height: float, rng: np.random.Generator, noise: PerturbNoise
) -> Objects:
    boxes = objects.boxes
    n = len(boxes)
    camera = boxes.centre.new_tensor([0.0, 0.0, camera_height])
    sight = boxes.centre - camera
    distance = torch.linalg.vector_norm(sight, dim=-1)
    lonlat = lonlat_from_direction(sight / distance[:, None].clamp(min=1e-9))

    # everything drawn in units of its standard deviation
    direction_draw = rng.standard_normal((n, 2))
    distance_draw = rng.standard_normal(n)
    size_draw = rng.standard_normal((n, 3))
    yaw_draw = rng.standard_normal(n)
    turned = (rng.random(n) < noise.flip) * rng.choice([-1.0, 1.0], n) * (np.pi / 2)
    edge_draw = rng.standard_normal((n, 4))
    score_draw = rng.standard_normal((3, n))

    def like_boxes(values: np.ndarray) -> Tensor:
        return torch.as_tensor(values, dtype=boxes.centre.dtype, device=boxes.centre.device)

    # small angles to the right of and above the line of sight, without a pole in the way
    offset = direction_from_lonlat(like_boxes(noise.direction * direction_draw))
    new_direction = (camera_from_turned(lonlat) @ offset[..., None]).squeeze(-1)
    new_distance = distance * like_boxes(np.exp(noise.distance * distance_draw))
    view_yaw = view_relative_yaw(boxes.yaw, lonlat[:, 0])
    view_yaw = view_yaw + like_boxes(noise.yaw * yaw_draw + turned)
    new_boxes = OrientedBoxes(
        centre=camera + new_direction * new_distance[:, None],
        size=boxes.size * like_boxes(np.exp(noise.size * size_draw)),
        yaw=yaw_from_view_relative(view_yaw, lonlat_from_direction(new_direction)[:, 0]),
    )

    yaw_error = np.abs(noise.yaw * yaw_draw + turned) / (noise.yaw if noise.yaw > 0.0 else 0.209)
    errors = np.stack(
        [
            np.abs(size_draw).max(axis=1) * (noise.size > 0.0),
            np.abs(distance_draw) * (noise.distance > 0.0),
            yaw_error,
        ]
    )
    logit = 3.0 - 1.2 * errors.clip(max=4.0) + 0.8 * score_draw
    scores = like_boxes(1.0 / (1.0 + np.exp(-logit)))
    return replace(
        objects,
        boxes=new_boxes,
        score=scores[0],
        distance_score=scores[1],
        yaw_score=scores[2],
        bfov=_jitter_bfov(objects.bfov, like_boxes(noise.bfov * edge_draw)),
    )


def _jitter_bfov(bfov: Float[Tensor, "n 4"], share: Float[Tensor, "n 4"]) -> Float[Tensor, "n 4"]:
    """Return BFoVs with left, right, lower, upper edge moved outwards by shares of the size."""
    left, right, low, high = share.clamp(-0.4, 0.4).unbind(-1)
    lon, lat, width, height = bfov.unbind(-1)
    centre = torch.stack([(right - left) / 2 * width, (high - low) / 2 * height], dim=-1)
    turned = camera_from_turned(torch.stack([lon, lat], dim=-1))
    moved = lonlat_from_direction((turned @ direction_from_lonlat(centre)[..., None]).squeeze(-1))
    new_width = (width * (1.0 + left + right)).clamp(max=2 * torch.pi)
    new_height = (height * (1.0 + low + high)).clamp(max=torch.pi)
    return torch.cat([moved, torch.stack([new_width, new_height], dim=-1)], dim=-1)


def _perturb_layout(layout: Layout, rng: np.random.Generator, sigma: float) -> Layout:
    """Return the layout with every wall moved along its normal; right angles stay right.

    Where the moved walls would no longer make a simple polygon around the camera, the same moves
    are halved until they do.
    """
    polygon = layout.floor_polygon
    moves = torch.as_tensor(sigma * rng.standard_normal(len(polygon))).to(polygon)
    rise = sigma * float(rng.standard_normal())
    if sigma == 0.0:
        return layout
    normals = wall_normals(polygon)
    # each corner obeys the moves of the two walls that meet in it
    pair = torch.stack([normals.roll(1, dims=0), normals], dim=1)
    wanted = torch.stack([moves.roll(1), moves], dim=1)
    shift = (torch.linalg.pinv(pair) @ wanted[..., None]).squeeze(-1)
    height = layout.ceiling_height - layout.floor_height
    for _ in range(20):
        moved = polygon + shift
        if polygon_problem(moved) is None and _sees_camera(moved):
            break
        shift = shift / 2
    else:
        moved = polygon
    ceiling = layout.floor_height + max(height + rise, 0.5 * height)
    return replace(layout, floor_polygon=moved, ceiling_height=ceiling)


def _sees_camera(polygon: Float[Tensor, "corners 2"]) -> bool:
    return bool(shapely.Polygon(polygon.tolist()).contains(shapely.Point(0.0, 0.0)))
