"""Doors that stand open: the leaf alone, turned about its hinge."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float64
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from panoscene.synth.assets import CadModel
from panoscene.synth.homes import Home, Opening

_WELD = 1e-5
_GAP = (0.006, 0.008)
"""Free metres beside the leaf on both sides together, and above and below it."""
_BEHIND = 0.015
"""Metres between the surface of the wall and the leaf."""


def door_leaf(model: CadModel) -> CadModel | None:
    """Return the leaf of a parametric door without its frame, or None if it has none.

    The frame is what reaches the sides of the model; leaf and handles are what is between.
    """
    half = model.size[0] / 2
    piece = _pieces(model)
    reach = np.zeros(int(piece.max(initial=-1)) + 1)
    np.maximum.at(reach, piece, np.abs(model.vertices[:, 0].astype(np.float64)))
    leaf = reach[piece] < half - 0.02
    faces = leaf[model.faces].all(axis=1)
    if not faces.any() or faces.all():
        return None
    used = np.unique(model.faces[faces])
    number = np.full(len(model.vertices), -1, np.int32)
    number[used] = np.arange(len(used), dtype=np.int32)
    points = model.vertices[used]
    low, high = points.min(axis=0), points.max(axis=0)
    width, depth, height = (float(v) for v in high - low)
    return replace(
        model,
        vertices=points - (low + high) / 2,
        normals=model.normals[used],
        uv=model.uv[used],
        faces=number[model.faces[faces]],
        face_material=model.face_material[faces],
        size=(width, depth, height),
    )


def leaf_pose(home: Home, opening: Opening, leaf: CadModel) -> Float64[np.ndarray, "4 4"]:
    """Return world_from_object of a leaf that hangs in a doorway and stands open.

    The leaf is stretched to the clear width and height. Its hinge is at the jamb that the opening
    says and its handles are on the other side; it turns into the room that the opening belongs to.
    """
    polygon = home.rooms[opening.room].polygon
    start = polygon[opening.wall]
    along = polygon[(opening.wall + 1) % len(polygon)] - start
    along = along / np.linalg.norm(along)
    inward = np.array([-along[1], along[0]])
    clear = opening.width - _GAP[0]
    height = opening.top - opening.bottom - _GAP[1]
    scale = np.array([clear / leaf.size[0], 1.0, height / leaf.size[2]])
    # seen from the room, where the model's front is, its right runs with the wall
    hinge_side = -1.0 if opening.hinge_at_start else 1.0
    facing = -1.0 if _handle_side(leaf) == hinge_side else 1.0
    right, front = facing * along, facing * inward
    middle = start + along * (opening.start + opening.width / 2)
    middle = middle - inward * (_BEHIND + leaf.size[1] / 2)
    end = 0.0 if opening.hinge_at_start else opening.width
    hinge = start + along * (opening.start + end) - inward * _BEHIND
    angle = abs(opening.swing) * (1.0 if opening.hinge_at_start else -1.0)
    cos, sin = np.cos(angle), np.sin(angle)
    turn = np.array([[cos, -sin], [sin, cos]])
    matrix = np.eye(4)
    matrix[:2, 0] = turn @ right * scale[0]
    matrix[:2, 1] = turn @ front * scale[1]
    matrix[2, 2] = scale[2]
    matrix[:2, 3] = hinge + turn @ (middle - hinge)
    matrix[2, 3] = opening.bottom + _GAP[1] / 2 + height / 2
    return matrix


def _handle_side(leaf: CadModel) -> float:
    """Return 1 if the handles, which stand out most, are at the right of a leaf, else -1."""
    out = np.abs(leaf.vertices[:, 1])
    handles = leaf.vertices[out > 0.9 * out.max(initial=0.0), 0]
    return 1.0 if float(handles.mean()) > 0.0 else -1.0


def _pieces(model: CadModel) -> np.ndarray:
    """Return for each vertex the number of the connected piece that it is part of."""
    keys = np.round(model.vertices / _WELD).astype(np.int64)
    _, same = np.unique(keys, axis=0, return_inverse=True)
    corners = same.reshape(-1)[model.faces]
    rows = np.concatenate([corners[:, 0], corners[:, 1]])
    columns = np.concatenate([corners[:, 1], corners[:, 2]])
    count = int(same.max(initial=-1)) + 1
    links = coo_matrix((np.ones(len(rows), np.bool_), (rows, columns)), shape=(count, count))
    return connected_components(links, directed=False)[1][same.reshape(-1)]
