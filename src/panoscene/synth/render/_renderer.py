"""Renders panoramas: a home is set up once and photographed several times."""

import time

import numpy as np

from panoscene.synth.render._camera import home_from_camera
from panoscene.synth.render._develop import denoise, develop
from panoscene.synth.render._even import even_light
from panoscene.synth.render._labels import cast_labels
from panoscene.synth.render._lamps import lamps_of
from panoscene.synth.render._light_choice import light_choice, room_grid
from panoscene.synth.render._mitsuba import load_engine
from panoscene.synth.render._outside import outside_picture
from panoscene.synth.render._records import Camera, LightSetting, RenderedPanorama, RenderScene
from panoscene.synth.render._stage import build_stage, relit_stage
from panoscene.synth.render._tracer import Tracer
from panoscene.synth.render._triangles import triangles_of


class Renderer:
    """Draws scenes with Mitsuba; one for each process."""

    def __init__(self, threads: int | None = None) -> None:
        """Start Mitsuba.

        Args:
            threads: that render; by default all cores.

        Raises:
            MissingRendererError: if Mitsuba, its denoiser or LLVM is not installed.
        """
        self._engine = load_engine(threads)

    def light_up(
        self,
        scene: RenderScene,
        light: LightSetting,
        *,
        outside_width: int = 1536,
        like: "LitScene | None" = None,
    ) -> "LitScene":
        """Return the scene in this light, ready for its cameras.

        Args:
            scene: the home.
            light: sky, sun and lamps.
            outside_width: of the panorama of the outside, in pixels.
            like: the same scene in another light, with which this one shares what does not depend
                on the light.

        Raises:
            ValueError: if the scene has no solid surface, or ``like`` is of another scene.
        """
        if like is not None and like.scene is not scene:
            raise ValueError("like: found another scene in a light, expected the one to light up")
        return LitScene(self, scene, light, outside_width, like)


class LitScene:
    """A home in one light. Hold those of one home at a time: they take a few hundred MB."""

    def __init__(
        self,
        renderer: Renderer,
        scene: RenderScene,
        light: LightSetting,
        outside_width: int,
        like: "LitScene | None" = None,
    ) -> None:
        start = time.process_time()
        engine = renderer._engine
        # Dr.Jit keeps the memory of earlier scenes, whose arrays had other sizes
        engine.dr.flush_malloc_cache()
        lamps = lamps_of(scene, light)
        triangles = triangles_of(scene, lamps)
        if like is None:
            stage = build_stage(engine, triangles, scene.panes)
        else:
            stage = relit_stage(engine, like._tracer.stage, triangles)
        choice = light_choice(scene, lamps, light)
        outside = outside_picture(light, outside_width)
        self._engine, self._light = engine, light
        self.scene = scene
        self._tracer = Tracer(engine, stage, room_grid(scene), choice, outside)
        self.seconds: dict[str, float] = {"scene": time.process_time() - start}
        """CPU seconds of each stage so far."""

    def photograph(
        self, camera: Camera, seed: int, *, samples: int = 12, depth: int = 6
    ) -> RenderedPanorama:
        """Return the panorama of a camera with its labels.

        Args:
            camera: where it stands and how large the picture is.
            seed: of the noise; the same seed gives the same picture on the same machine.
            samples: paths through each pixel; half as many within 45 degrees of a pole.
            depth: surfaces that a path meets at most.
        """
        start = time.process_time()
        image = self._tracer.trace(camera, samples, depth, seed)
        traced = time.process_time()
        radiance = denoise(self._engine, image)
        cleaned = time.process_time()
        labels = cast_labels(self._tracer, camera)
        labelled = time.process_time()
        radiance = even_light(radiance, labels.albedo, labels.normal)
        rgb = develop(radiance, labels.albedo, self._light)
        stages = np.diff([start, traced, cleaned, labelled, time.process_time()])
        for name, spent in zip(("paths", "denoiser", "labels", "develop"), stages, strict=True):
            self.seconds[name] = self.seconds.get(name, 0.0) + float(spent)
        turned = labels.normal @ home_from_camera(camera).astype(np.float32)
        paint = np.where(
            labels.albedo <= 0.0031308,
            labels.albedo * 12.92,
            1.055 * np.maximum(labels.albedo, 1e-6) ** (1 / 2.4) - 0.055,
        )
        return RenderedPanorama(
            rgb,
            labels.distance,
            labels.instance,
            turned,
            (np.clip(paint, 0, 1) * 255 + 0.5).astype(np.uint8),
            radiance,
            camera,
        )
