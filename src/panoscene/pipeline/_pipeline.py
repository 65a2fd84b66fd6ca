"""The one path from a panorama to a scene."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.arrange import ArrangementSettings, Certificate, arrange
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import (
    Detections,
    Layout,
    Panorama,
    Relations,
    Scene,
    relations_from_boxes,
    upright_photo,
)

from ._records import Given, Reconstruction
from ._stages import Stages

SIZE = (512, 1024)
"""Rows and columns of the panorama that the networks see."""
LEAST_TILT = math.radians(0.5)
"""Radians; a photo that leans less is taken as it is, for its estimate errs by as much."""
TOLD_TILT = math.radians(3.0)
"""Radians; from here on the user is told that the camera leant."""
WEAK_WALL = 0.4
"""Mean confidence of the walls below which a room may be none."""


class Pipeline:
    """Photos to scenes: upright, detections, layout, boxes, relations, arrangement, shapes.

    Source: paper, Section 3 and Figure 2.
    """

    def __init__(
        self, stages: Stages, *, settings: ArrangementSettings | str | None = "default"
    ) -> None:
        """Put a pipeline together.

        Args:
            stages: what detects, reads the layout, places and shapes.
            settings: of the arrangement, or a preset's name; None leaves the arrangement out.
        """
        self._stages = stages
        self._settings = settings

    @torch.inference_mode()
    def __call__(
        self,
        image: Float[Tensor, "3 height width"],
        panorama: Panorama | None = None,
        *,
        given: Given | None = None,
        name: str = "",
        resolution: int = 64,
    ) -> Reconstruction:
        """Return the scene that a photo shows.

        Convention:
            - the world frame is that of the upright panorama; ``Panorama.upright_from_photo`` of
              the scene says how the photo was turned, so that every result can be found in it

        Args:
            image: the photo as it was taken, RGB in [0, 1], of any size from 64 x 32.
            panorama: what is known about it; a camera 1.6 m high when None.
            given: records that take the place of stages.
            name: of the scene.
            resolution: of the grid in which meshes are found, for each side of a box.
        """
        clock = _Clock()
        given = given or Given()
        panorama = panorama or Panorama(image.shape[-1], image.shape[-2])
        doubts: list[str] = []
        with clock("upright"):
            panorama = self._levelled(image, panorama, doubts)
            seen = upright_photo(_reduced(image), panorama)
        found = self._detected(seen, given, clock)
        read, layout = self._read_layout(seen, panorama, given, clock)
        with clock("pose"):
            objects = given.objects
            if objects is None:
                height = panorama.camera_height
                objects = self._stages.pose(seen, found, layout, height)
        initial = Scene(panorama, layout, objects, given.relations, name)
        scene, certificate = self._arranged(initial, clock)
        if self._stages.shape is not None:
            with clock("shape"):
                shapes = self._stages.shape(seen, scene.objects, resolution=resolution)
                scene = replace(scene, objects=replace(scene.objects, shapes=shapes))
        doubts += _doubts(read, layout, scene)
        return Reconstruction(scene, initial, seen, certificate, read, clock.seconds, tuple(doubts))

    def _levelled(
        self, image: Float[Tensor, "3 height width"], panorama: Panorama, doubts: list[str]
    ) -> Panorama:
        """Return the panorama with the rotation that makes its photo upright."""
        if self._stages.leveller is None:
            return panorama
        estimate = self._stages.leveller(_reduced(image))
        # an uncertain estimate says that the tilt is 0
        if estimate.tilt < LEAST_TILT:
            return panorama
        if estimate.tilt >= TOLD_TILT:
            degrees = math.degrees(estimate.tilt)
            doubts.append(f"the camera was tilted by {degrees:.0f} degrees; the photo was turned")
        return replace(panorama, upright_from_photo=estimate.upright_from_photo)

    def _detected(
        self, image: Float[Tensor, "3 height width"], given: Given, clock: "_Clock"
    ) -> Detections:
        if given.objects is not None:
            objects = given.objects
            return Detections(objects.bfov, objects.category, objects.score)
        if given.detections is not None:
            return given.detections
        with clock("detector"):
            return self._stages.detector(image)

    def _read_layout(
        self,
        image: Float[Tensor, "3 height width"],
        panorama: Panorama,
        given: Given,
        clock: "_Clock",
    ) -> tuple[LayoutPrediction | None, Layout]:
        if given.layout is not None:
            return None, given.layout
        with clock("layout"):
            read = self._stages.layout(image, camera_height=panorama.camera_height)
        return read, read.layout

    def _arranged(self, scene: Scene, clock: "_Clock") -> tuple[Scene, Certificate | None]:
        """Return the arranged scene with the relations of its boxes."""
        certificate = None
        with clock("arrangement"):
            if self._settings is not None:
                start = scene
                if scene.relations is None:
                    start = replace(scene, relations=_relations(scene, "any_corner"))
                arrangement = arrange(start, self._settings)
                scene, certificate = arrangement.scene, arrangement.certificate
            return replace(scene, relations=_relations(scene, "full")), certificate


@dataclass(slots=True)
class _Clock:
    """Seconds for each part of the work."""

    seconds: dict[str, float] = field(default_factory=dict[str, float])

    @contextmanager
    def __call__(self, part: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self.seconds[part] = time.perf_counter() - start


def _reduced(image: Float[Tensor, "3 height width"]) -> Float[Tensor, "3 rows columns"]:
    """Return a picture in the size that networks see."""
    if image.shape[-2:] == SIZE:
        return image
    mode = "area" if image.shape[-1] > SIZE[1] else "bilinear"
    return torch.nn.functional.interpolate(image[None], size=SIZE, mode=mode)[0]


def _relations(scene: Scene, inside: str) -> Relations:
    boxes, height = scene.objects.boxes, scene.panorama.camera_height
    if inside == "full":
        return relations_from_boxes(boxes, scene.layout, height)
    # boxes that are wrong by more than a tolerance are inside if a corner of them is
    return relations_from_boxes(boxes, scene.layout, height, inside="any_corner")


def _doubts(read: LayoutPrediction | None, layout: Layout, scene: Scene) -> list[str]:
    """Return what a user should know before using the result."""
    doubts = []
    if read is not None and read.ambiguous:
        doubts.append("the room can be read in two ways, perhaps because of an open doorway")
    if layout.wall_score is not None and float(layout.wall_score.mean()) < WEAK_WALL:
        doubts.append("the walls are uncertain: this may not be a room, or not an indoor photo")
    if len(scene.objects.boxes) == 0:
        doubts.append("no object was found")
    return doubts
