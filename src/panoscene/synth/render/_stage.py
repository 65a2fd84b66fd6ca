"""The scene inside Mitsuba: three small worlds that rays are cast into, and their tables."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float32, Int32

from panoscene.synth.render._mitsuba import Engine
from panoscene.synth.render._paint import pack_paints
from panoscene.synth.render._records import WindowPane
from panoscene.synth.render._triangles import Triangles


@dataclass(slots=True)
class Stage:
    """What rays meet. The tables run over the faces of solids and veils together.

    Everything is data: the code of the tracer is the same for all scenes and is compiled once.
    """

    solids: Any
    """A world that stops light."""
    veils: Any
    """Seen directly and in mirrors only: glass, gauze, lamp shades, bulbs. Light passes."""
    panes: Any
    """Two triangles for every window pane."""
    first_veil: Any
    faces: Any
    normals: Any
    uv: Any
    flat: Any
    """Unit normals of the faces."""
    tangent: Any
    """Unit vectors along u, and the sign that makes normal x tangent point along v."""
    material: Any
    glow: Any
    paint: Any
    metal_opacity: Any
    texels: Any
    bumps: Any
    instance: Int32[np.ndarray, " faces"]
    pane_instance: Int32[np.ndarray, " panes"]
    pane_normal: Float32[np.ndarray, "panes 3"]


def build_stage(engine: Engine, triangles: Triangles, panes: tuple[WindowPane, ...]) -> Stage:
    """Return the worlds and tables of a scene."""
    upload = partial(_uploaded, engine)
    paints = pack_paints(triangles.materials)
    flat, tangent = _face_frames(triangles)
    split = triangles.solids
    return Stage(
        _world(engine, triangles.vertices, triangles.faces[:split]),
        _world(engine, triangles.vertices, triangles.faces[split:]),
        _world(engine, *_pane_mesh(panes)),
        engine.dr.opaque(engine.mi.UInt32, split),
        upload(triangles.faces),
        upload(triangles.normals),
        upload(triangles.uv),
        upload(flat),
        upload(tangent),
        upload(triangles.material),
        upload(triangles.glow),
        upload(paints.table),
        upload(paints.metal_opacity),
        upload(paints.texels),
        upload(paints.normals),
        triangles.instance,
        np.array([pane.instance for pane in panes] or [0], np.int32),
        np.array([pane.normal for pane in panes] or [(0, 0, 1)], np.float32),
    )


def relit_stage(engine: Engine, stage: Stage, triangles: Triangles) -> Stage:
    """Return a stage in the light of other lamps: all but the glow is shared with the first one.

    Args:
        engine: Mitsuba.
        stage: of the scene in any light.
        triangles: of the same scene in the new light.
    """
    return replace(stage, glow=_uploaded(engine, triangles.glow))


def _uploaded(engine: Engine, array: np.ndarray) -> Any:
    kind = engine.mi.UInt32 if array.dtype == np.uint32 else engine.mi.Float
    return kind(np.ascontiguousarray(array).reshape(-1))


def _world(engine: Engine, vertices: np.ndarray, faces: np.ndarray) -> Any:
    mi = engine.mi
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    mesh = mi.Mesh("mesh", len(vertices), len(faces))
    parameters = mi.traverse(mesh)
    flat = np.ascontiguousarray(vertices, dtype=np.float32).reshape(-1)
    parameters["vertex_positions"] = mi.Float(flat)
    parameters["faces"] = mi.UInt32(faces.astype(np.uint32).reshape(-1))
    parameters.update()
    return mi.load_dict({"type": "scene", "mesh": mesh})


def _face_frames(
    triangles: Triangles,
) -> tuple[Float32[np.ndarray, "faces 3"], Float32[np.ndarray, "faces 4"]]:
    """Return the faces' unit normals, and their tangents with a sign."""
    p, uv = triangles.vertices[triangles.faces], triangles.uv[triangles.faces]
    along, across = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    normal = np.cross(along, across)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-20)
    du, dv = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    area = du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0]
    tangent = along * dv[:, 1:] - across * du[:, 1:]
    tangent *= np.where(area < 0, -1, 1)[:, None]
    length = np.linalg.norm(tangent, axis=1, keepdims=True)
    tangent = np.where(length > 1e-12, tangent / np.maximum(length, 1e-12), (1.0, 0.0, 0.0))
    signed = np.concatenate([tangent, np.where(area < 0, -1.0, 1.0)[:, None]], axis=1)
    return normal.astype(np.float32), signed.astype(np.float32)


def _pane_mesh(panes: tuple[WindowPane, ...]) -> tuple[np.ndarray, np.ndarray]:
    """Return rectangles; triangles 2 k and 2 k + 1 belong to pane k. Far away if there is none."""
    if not panes:
        far = np.array([[0, 0, -2e4], [1e-3, 0, -2e4], [0, 1e-3, -2e4]])
        return far, np.array([[0, 1, 2]])
    centre = np.array([p.centre for p in panes])
    u, v = np.array([p.half_u for p in panes]), np.array([p.half_v for p in panes])
    corners = np.stack([centre - u - v, centre + u - v, centre + u + v, centre - u + v], axis=1)
    first = 4 * np.arange(len(panes))[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])], axis=1)
    return corners.reshape(-1, 3), faces.reshape(-1, 3)
