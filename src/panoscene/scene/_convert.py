"""Scene records to scene.json documents and back."""

from typing import Any

import torch
from jaxtyping import Float
from pydantic import ValidationError
from torch import Tensor

from panoscene.geometry import OrientedBoxes, bfov_from_boxes

from ._categories import CATEGORIES, category_index
from ._checks import document_problems, names_in_model, schema_problems, version_problems
from ._errors import Problem, SceneFormatError
from ._numbers import numbers_from_tensor, tensor_from_numbers
from ._records import Layout, Mesh, Objects, Panorama, Scene, Shapes, ShapeSource
from ._relations_json import relations_from_model, relations_to_json
from ._schema import FRAME, SCHEMA_NAME, SCHEMA_VERSION, UNITS, ObjectModel, SceneModel, ShapeModel
from ._triples import object_names


def scene_from_json(
    document: object, *, file: str = "scene", dtype: torch.dtype = torch.float32
) -> Scene:
    """Return the scene that a parsed scene.json document describes.

    Args:
        document: What ``json.loads`` returns.
        file: What error messages call the document.
        dtype: Float type of all tensors; float64 documents keep all digits only as float64.

    Raises:
        SceneFormatError: The document is not a valid scene; all problems are listed.
    """
    problems = version_problems(document)
    if problems:
        raise SceneFormatError(file, problems)
    try:
        model = SceneModel.model_validate(document)
    except ValidationError as error:
        raise SceneFormatError(file, schema_problems(error)) from None
    problems = document_problems(model)
    if problems:
        raise SceneFormatError(file, problems)
    return _scene_from_model(model, dtype)


def scene_to_json(scene: Scene, *, file: str = "scene") -> dict[str, Any]:
    """Return the scene as a document for ``json.dumps``, checked against the format.

    Numbers are exact: ``scene_from_json`` gives every tensor back bit for bit (in its dtype).

    Raises:
        SceneFormatError: The scene cannot be a scene file, for example because of a NaN.
    """
    panorama, layout = scene.panorama, scene.layout
    document: dict[str, Any] = {
        "schema": SCHEMA_NAME,
        "version": SCHEMA_VERSION,
        "units": UNITS,
        "frame": FRAME,
        "name": scene.name,
        "seed": scene.seed,
        "panorama": {
            "width": panorama.width,
            "height": panorama.height,
            "camera_height": float(panorama.camera_height),
            "file": panorama.file,
            "upright_from_photo": [list(row) for row in panorama.upright_from_photo],
        },
        "layout": {
            "floor_polygon": numbers_from_tensor(layout.floor_polygon),
            "floor_height": float(layout.floor_height),
            "ceiling_height": float(layout.ceiling_height),
        },
        "objects": _objects_to_json(scene.objects, file),
    }
    if layout.wall_score is not None:
        document["layout"]["wall_score"] = numbers_from_tensor(layout.wall_score)
    if layout.raw_polygon is not None:
        document["layout"]["raw_polygon"] = numbers_from_tensor(layout.raw_polygon)
    if scene.relations is not None:
        document["relations"] = relations_to_json(
            scene.relations, object_names(scene.objects), len(layout.floor_polygon), file
        )
    try:
        model = SceneModel.model_validate(document)
    except ValidationError as error:
        raise SceneFormatError(file, schema_problems(error)) from None
    problems = document_problems(model)
    if problems:
        raise SceneFormatError(file, problems)
    return document


def _objects_to_json(objects: Objects, file: str) -> list[dict[str, Any]]:
    boxes, shapes = objects.boxes, objects.shapes
    n = len(objects.category)
    _check_lengths(objects, n, file)
    columns: dict[str, Any] = {
        "centre": numbers_from_tensor(boxes.centre),
        "size": numbers_from_tensor(boxes.size),
        "yaw": numbers_from_tensor(boxes.yaw),
        "category": numbers_from_tensor(objects.category),
        "score": numbers_from_tensor(objects.score),
        "distance_score": numbers_from_tensor(objects.distance_score),
        "yaw_score": numbers_from_tensor(objects.yaw_score),
        "bfov": numbers_from_tensor(objects.bfov),
        "code": None if shapes.code is None else numbers_from_tensor(shapes.code),
    }
    documents: list[dict[str, Any]] = []
    for k in range(n):
        document: dict[str, Any] = {"id": objects.id[k]} if objects.id else {}
        category = columns["category"][k]
        known = 0 <= category < len(CATEGORIES)
        document["category"] = CATEGORIES[category] if known else f"index {category}"
        document["box"] = {name: columns[name][k] for name in ("centre", "size", "yaw")}
        for name in ("score", "distance_score", "yaw_score"):
            document[name] = columns[name][k]
        lon, lat, width, height = columns["bfov"][k]
        document["bfov"] = {"lon": lon, "lat": lat, "width": width, "height": height}
        shape: dict[str, Any] = {}
        if columns["code"] is not None:
            shape["code"] = columns["code"][k]
        mesh = shapes.mesh[k] if shapes.mesh else None
        if mesh is not None:
            shape["mesh"] = {
                "vertices": numbers_from_tensor(mesh.vertices),
                "faces": numbers_from_tensor(mesh.faces),
            }
        if shapes.source:
            shape["source"] = shapes.source[k]
        if shape:
            document["shape"] = shape
        documents.append(document)
    return documents


def _check_lengths(objects: Objects, n: int, file: str) -> None:
    lengths = {
        "boxes": len(objects.boxes),
        "score": len(objects.score),
        "bfov": len(objects.bfov),
        "distance_score": len(objects.distance_score),
        "yaw_score": len(objects.yaw_score),
        "id": len(objects.id) or n,
        "shapes.code": n if objects.shapes.code is None else len(objects.shapes.code),
        "shapes.mesh": len(objects.shapes.mesh) or n,
        "shapes.source": len(objects.shapes.source) or n,
    }
    problems = [
        Problem(f"objects.{name}", f"{length} entries", f"{n}, as many as categories")
        for name, length in lengths.items()
        if length != n
    ]
    if problems:
        raise SceneFormatError(file, problems)


def _scene_from_model(model: SceneModel, dtype: torch.dtype) -> Scene:
    walls = len(model.layout.floor_polygon)
    relations = model.relations
    names = names_in_model(model.objects)
    score, raw = model.layout.wall_score, model.layout.raw_polygon
    return Scene(
        panorama=Panorama(**dict(model.panorama)),
        layout=Layout(
            floor_polygon=tensor_from_numbers(model.layout.floor_polygon, (-1, 2), dtype),
            floor_height=model.layout.floor_height,
            ceiling_height=model.layout.ceiling_height,
            wall_score=None if score is None else tensor_from_numbers(score, (-1,), dtype),
            raw_polygon=None if raw is None else tensor_from_numbers(raw, (-1, 2), dtype),
        ),
        objects=_objects_from_models(model.objects, model.panorama.camera_height, dtype),
        relations=None
        if relations is None
        else relations_from_model(relations, names, walls, dtype),
        name=model.name,
        seed=model.seed,
    )


def _objects_from_models(
    models: list[ObjectModel], camera_height: float, dtype: torch.dtype
) -> Objects:
    def column(values: list[Any], *width: int) -> Tensor:
        return tensor_from_numbers(values, (len(models), *width), dtype)

    boxes = OrientedBoxes(
        column([item.box.centre for item in models], 3),
        column([item.box.size for item in models], 3),
        column([item.box.yaw for item in models]),
    )
    return Objects(
        boxes=boxes,
        category=torch.tensor(
            [category_index(item.category) for item in models], dtype=torch.int64
        ),
        score=column([item.score for item in models]),
        bfov=_bfov_from_models(models, boxes, camera_height),
        distance_score=column([item.distance_score for item in models]),
        yaw_score=column([item.yaw_score for item in models]),
        id=tuple(names_in_model(models)) if any(item.id is not None for item in models) else (),
        shapes=_shapes_from_models(models, dtype),
    )


def _bfov_from_models(
    models: list[ObjectModel], boxes: OrientedBoxes, camera_height: float
) -> Float[Tensor, "n 4"]:
    bfov = torch.zeros_like(boxes.yaw[:, None]).repeat(1, 4)
    given = [k for k, item in enumerate(models) if item.bfov is not None]
    if len(given) < len(models):
        bfov = bfov_from_boxes(boxes, camera_height)
    if given:
        numbers = [list(dict(item.bfov).values()) for item in models if item.bfov is not None]
        bfov[given] = tensor_from_numbers(numbers, (len(given), 4), bfov.dtype)
    return bfov


def _shapes_from_models(models: list[ObjectModel], dtype: torch.dtype) -> Shapes:
    shapes = [item.shape for item in models]
    codes = [shape.code for shape in shapes if shape is not None and shape.code is not None]
    meshes = tuple(
        Mesh(
            tensor_from_numbers(shape.mesh.vertices, (-1, 3), dtype),
            tensor_from_numbers(shape.mesh.faces, (-1, 3), torch.int64),
        )
        if shape is not None and shape.mesh is not None
        else None
        for shape in shapes
    )
    return Shapes(
        code=torch.tensor(codes, dtype=dtype) if codes else None,
        mesh=meshes if any(mesh is not None for mesh in meshes) else (),
        source=_sources(shapes),
    )


def _sources(shapes: list[ShapeModel | None]) -> tuple[ShapeSource, ...]:
    """Return where shapes come from; () when no object says so.

    Where others do, a mesh that does not say is a model, and no mesh a box.
    """
    said = [None if shape is None else shape.source for shape in shapes]
    if all(source is None for source in said):
        return ()
    return tuple(_source(shape) for shape in shapes)


def _source(shape: ShapeModel | None) -> ShapeSource:
    if shape is None:
        return "box"
    if shape.source is not None:
        return shape.source
    return "box" if shape.mesh is None else "model"
