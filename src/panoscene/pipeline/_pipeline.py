"""The one path from a panorama to a scene."""

import math
from dataclasses import replace

import torch
from jaxtyping import Float
from torch import Tensor

from panoscene.arrange import ArrangementSettings, Certificate, arrange
from panoscene.models.layout import LayoutPrediction
from panoscene.scene import (
    Detections,
    Layout,
    Objects,
    Panorama,
    Relations,
    Scene,
    upright_photo,
)

from ._clock import Clock
from ._doubles import without_doubles
from ._flags import photo_flags, scene_flags
from ._records import Given, Reconstruction
from ._relations import final_relations, held_relations
from ._settings import PHOTO
from ._sphere import sphere_gaps
from ._stages import Stages

SIZE = (512, 1024)
"""Rows and columns of the panorama that the networks see."""
LEAST_TILT = math.radians(0.5)
"""Radians; a photo that leans less is taken as it is, for its estimate errs by as much."""


class Pipeline:
    """Photos to scenes: upright, detections, layout, boxes and relations, arrangement, shapes.

    Source: paper, Section 3 and Figure 2.
    """

    def __init__(
        self, stages: Stages, *, settings: ArrangementSettings | str | None = PHOTO
    ) -> None:
        """Put a pipeline together.

        Args:
            stages: what detects, reads the layout, places and shapes.
            settings: of the arrangement, or a preset's name; None leaves the arrangement out.
        """
        self._stages = stages
        self._settings = settings

    @property
    def stages(self) -> Stages:
        """Return the stages, to make another pipeline of some of them."""
        return self._stages

    @property
    def settings(self) -> ArrangementSettings | str | None:
        """Return what the arrangement was told; None where it is left out."""
        return self._settings

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
        placed = self.place(image, panorama, given=given, name=name)
        return self.shape(placed, resolution=resolution)

    @torch.inference_mode()
    def place(
        self,
        image: Float[Tensor, "3 height width"],
        panorama: Panorama | None = None,
        *,
        given: Given | None = None,
        name: str = "",
    ) -> Reconstruction:
        """Return the scene that a photo shows, with boxes for all objects: meshes come last.

        Args:
            image: as in a call.
            panorama: as in a call.
            given: as in a call.
            name: as in a call.
        """
        clock = Clock()
        given = given or Given()
        panorama = panorama or Panorama(image.shape[-1], image.shape[-2])
        with clock("upright"):
            reduced = _reduced(image)
            gaps = sphere_gaps(reduced)
            panorama, tilt = self._levelled(reduced, panorama, given)
            seen = upright_photo(reduced, panorama)
        found = self._detected(seen, given, clock)
        read, layout = self._read_layout(seen, panorama, given, clock)
        objects, relations = given.objects, None
        if objects is None:
            height = panorama.camera_height
            objects, relations = self._placed(seen, found, layout, height, clock)
        initial = Scene(panorama, layout, objects, given.relations or relations, name)
        if given.objects is None and given.detections is None and given.relations is None:
            initial = without_doubles(initial)
        scene, certificate = self._arranged(initial, clock)
        flags = photo_flags(gaps, tilt, image.shape[-1]) + scene_flags(read, scene)
        return Reconstruction(scene, initial, seen, certificate, read, clock.seconds, flags)

    def shape(self, placed: Reconstruction, *, resolution: int = 64) -> Reconstruction:
        """Return a placed scene with a mesh for each object, unless it has meshes already.

        Args:
            placed: by ``place``.
            resolution: as in a call.
        """
        objects = placed.scene.objects
        if self._stages.shape is None or objects.shapes.mesh:
            return placed
        clock = Clock()
        with clock("shape"):
            shapes = self._stages.shape(placed.image, objects, resolution=resolution)
        scene = replace(placed.scene, objects=replace(objects, shapes=shapes))
        return replace(placed, scene=scene, timings={**placed.timings, **clock.seconds})

    def _levelled(
        self, image: Float[Tensor, "3 rows columns"], panorama: Panorama, given: Given
    ) -> tuple[Panorama, float]:
        """Return the panorama with the rotation that makes its photo upright, and the tilt."""
        if given.upright_from_photo is not None:
            return replace(panorama, upright_from_photo=given.upright_from_photo), 0.0
        if self._stages.leveller is None:
            return panorama, 0.0
        estimate = self._stages.leveller(image)
        # an uncertain estimate says that the tilt is 0
        if estimate.tilt < LEAST_TILT:
            return panorama, 0.0
        turned = replace(panorama, upright_from_photo=estimate.upright_from_photo)
        return turned, estimate.tilt

    def _detected(
        self, image: Float[Tensor, "3 height width"], given: Given, clock: Clock
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
        clock: Clock,
    ) -> tuple[LayoutPrediction | None, Layout]:
        if given.layout is not None:
            return None, given.layout
        with clock("layout"):
            read = self._stages.layout(image, camera_height=panorama.camera_height)
        return read, read.layout

    def _placed(
        self,
        image: Float[Tensor, "3 height width"],
        found: Detections,
        layout: Layout,
        camera_height: float,
        clock: Clock,
    ) -> tuple[Objects, Relations | None]:
        """Return boxes, and relations where a stage says more than what follows from the boxes."""
        if self._stages.context is None:
            with clock("pose"):
                return self._stages.pose(image, found, layout, camera_height), None
        with clock("context"):
            return self._stages.context(image, found, layout, camera_height, clock=clock)

    def _arranged(self, scene: Scene, clock: Clock) -> tuple[Scene, Certificate | None]:
        """Return the arranged scene with relations that fit its boxes."""
        said, certificate = scene.relations, None
        with clock("arrangement"):
            if self._settings is not None:
                start = replace(scene, relations=held_relations(scene))
                arrangement = arrange(start, self._settings)
                scene, certificate = arrangement.scene, arrangement.certificate
            return replace(scene, relations=final_relations(scene, said)), certificate


def _reduced(image: Float[Tensor, "3 height width"]) -> Float[Tensor, "3 rows columns"]:
    """Return a picture in the size that networks see."""
    if image.shape[-2:] == SIZE:
        return image
    mode = "area" if image.shape[-1] > SIZE[1] else "bilinear"
    return torch.nn.functional.interpolate(image[None], size=SIZE, mode=mode)[0]
