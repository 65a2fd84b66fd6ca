"""A panorama as it was read from disk, and the pixels of its objects."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64, Int32, UInt8

from panoscene.scene import Scene
from panoscene.synth.assets import CadModel

from ._format import PanoramaLabels
from ._pixels import pixel_directions


@dataclass(frozen=True)
class Loaded:
    """A panorama as it was read from disk, for the checks."""

    name: str
    scene: Scene
    labels: PanoramaLabels
    rgb: UInt8[np.ndarray, "height width 3"]
    distance: Float64[np.ndarray, "height width"]
    """Metres."""
    instance: Int32[np.ndarray, "height width"]
    semantic: Int32[np.ndarray, "height width"]
    library: Mapping[str, CadModel] | None = None
    """Models by id, for checks against the meshes."""

    @cached_property
    def upright(self) -> Float64[np.ndarray, "3 3"]:
        """Rotation from the photo's directions to the world's."""
        return np.array(self.scene.panorama.upright_from_photo)

    @cached_property
    def directions(self) -> Float64[np.ndarray, "height width 3"]:
        """Unit directions of the pixels in the world frame."""
        return pixel_directions(*self.instance.shape) @ self.upright.T

    @property
    def eye(self) -> Float64[np.ndarray, "3"]:
        """The camera in the world frame."""
        return np.array([0.0, 0.0, self.scene.panorama.camera_height])

    @cached_property
    def object_pixels(self) -> "ObjectPixels":
        """Pixels of the labelled objects in their boxes' frames."""
        return _object_pixels(self)


@dataclass(frozen=True, slots=True)
class ObjectPixels:
    """The pixels of all labelled objects, sorted by object; object k has those from start[k]."""

    start: np.ndarray
    owner: np.ndarray
    eye: np.ndarray
    """The camera in each object's frame."""
    half: np.ndarray
    """Half sizes of the boxes."""
    ray: np.ndarray
    """Directions of the pixels, in the frames of their objects."""
    distance: np.ndarray
    flat: np.ndarray
    """Place of each pixel in the picture, row by row."""


def _object_pixels(panorama: Loaded) -> ObjectPixels:
    objects = panorama.labels.objects
    place = np.full(65536, -1, np.int64)
    for k, label in enumerate(objects):
        place[label.instance] = k
    flat = np.flatnonzero(place[panorama.instance.reshape(-1)] >= 0)
    owner = place[panorama.instance.reshape(-1)[flat]]
    order = np.argsort(owner, kind="stable")
    flat, owner = flat[order], owner[order]
    start = np.searchsorted(owner, np.arange(len(objects) + 1))
    yaw = np.array([label.box.yaw for label in objects])
    centre = np.array([label.box.centre for label in objects]).reshape(-1, 3)
    half = np.array([label.box.size for label in objects]).reshape(-1, 3) / 2
    cos, sin, zero = np.cos(yaw), np.sin(yaw), np.zeros(len(objects))
    turn = np.stack(
        [np.stack([cos, sin, zero], -1), np.stack([-sin, cos, zero], -1),
         np.stack([zero, zero, zero + 1], -1)], axis=1
    )  # fmt: skip
    eye = np.einsum("nij,nj->ni", turn, panorama.eye - centre)
    rays = panorama.directions.reshape(-1, 3)[flat]
    local = np.einsum("pij,pj->pi", turn[owner], rays)
    return ObjectPixels(start, owner, eye, half, local, panorama.distance.reshape(-1)[flat], flat)
