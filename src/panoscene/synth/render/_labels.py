"""Exact labels: one ray through the centre of every pixel."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float32, Int32

from panoscene.synth.render._records import Camera
from panoscene.synth.render._surface import meet
from panoscene.synth.render._tracer import Tracer


class Labels(NamedTuple):
    """What the pixels of a panorama show."""

    distance: Float32[np.ndarray, "height width"]
    instance: Int32[np.ndarray, "height width"]
    normal: Float32[np.ndarray, "height width 3"]
    """In the home's frame, turned to the camera."""
    albedo: Float32[np.ndarray, "height width 3"]
    """Linear."""


def cast_labels(tracer: Tracer, camera: Camera) -> Labels:
    """Return the nearest surface through each pixel centre: solid, glass or window pane."""
    mi, dr = tracer.engine.mi, tracer.engine.dr
    stage, width, height = tracer.stage, camera.width, camera.height
    index = dr.arange(mi.UInt32, width * height)
    x, y = mi.Float(index % width) + 0.5, mi.Float(index // width) + 0.5
    ray = tracer.camera_ray(camera, x / width, y / height)
    every = mi.Bool(True)
    hit, pane_met, pane = tracer.cast(ray, every, every)
    surface = meet(tracer.engine, stage, ray, hit, hit.valid)
    normal = dr.select(hit.valid, surface.smooth, 0)
    colour = dr.select(hit.valid, surface.colour, 0)
    dr.eval(hit.t, hit.face, hit.valid, pane_met, pane, normal, colour)
    seen, framed = np.array(hit.valid), np.array(pane_met)
    distance = np.where(seen | framed, np.array(hit.t), 0)
    instance = np.where(seen, stage.instance[np.where(seen, np.array(hit.face), 0)], 0)
    behind = np.array(pane)[framed]
    instance[framed] = stage.pane_instance[behind]
    normal, colour = np.array(normal).T, np.array(colour).T
    normal[framed], colour[framed] = stage.pane_normal[behind], 1.0
    return Labels(
        distance.reshape(height, width).astype(np.float32),
        instance.reshape(height, width).astype(np.int32),
        normal.reshape(height, width, 3).astype(np.float32),
        colour.reshape(height, width, 3).astype(np.float32),
    )
