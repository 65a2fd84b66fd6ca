"""Triangles out of the buffer of a glTF document."""

import numpy as np
from jaxtyping import Float, Int64, Shaped

from panoscene.exports._gltf_schema import GltfFile, PrimitiveModel

_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WHOLE, _FLOAT = (5121, 5123, 5125), (5126,)
_COLUMNS = {"SCALAR": 1, "VEC3": 3}
_TRIANGLES = 4

MAX_TRIANGLES = 10_000_000
"""Of a file; a small file could otherwise ask for the same numbers again and again."""


def mesh_triangles(
    source: GltfFile, index: int, field: str
) -> tuple[Float[np.ndarray, "vertices 3"], Int64[np.ndarray, "faces 3"]]:
    """Return vertices and faces of a mesh, all its primitives together, in the node's axes.

    Args:
        source: The file.
        index: Of the mesh.
        field: What refers to it, for error messages.

    Raises:
        SceneFormatError: An index, an offset or a number that cannot be; anything but triangles.
    """
    mesh = source.item(source.gltf.meshes, index, field)
    vertices: dict[int, np.ndarray] = {}
    first: dict[int, int] = {}
    faces: list[np.ndarray] = []
    count, drawn = 0, 0
    for k, primitive in enumerate(mesh.primitives):
        place = f"$.meshes[{index}].primitives[{k}]"
        accessor = _position(source, primitive, place)
        if accessor not in vertices:
            vertices[accessor] = _points(source, accessor, f"{place}.attributes.POSITION")
            first[accessor] = count
            count += len(vertices[accessor])
        triangles = _faces(source, primitive, len(vertices[accessor]), place)
        faces.append(triangles + first[accessor])
        drawn += len(triangles)
        if max(drawn, count) > MAX_TRIANGLES:
            raise source.refusal(place, "more triangles", f"at most {MAX_TRIANGLES}")
    return np.concatenate(list(vertices.values())).astype(np.float64), np.concatenate(faces)


def _position(source: GltfFile, primitive: PrimitiveModel, place: str) -> int:
    """Return the accessor of the vertices."""
    if primitive.mode != _TRIANGLES:
        raise source.refusal(f"{place}.mode", str(primitive.mode), f"{_TRIANGLES}: triangles")
    accessor = primitive.attributes.get("POSITION")
    if accessor is None:
        raise source.refusal(f"{place}.attributes", "no POSITION", "the vertices of the mesh")
    return accessor


def _points(source: GltfFile, accessor: int, field: str) -> Float[np.ndarray, "vertices 3"]:
    points = _numbers(source, accessor, ("VEC3", _FLOAT), field)
    if not bool((np.abs(points) <= 1e9).all()):  # false for NaN as well
        raise source.refusal(f"$.accessors[{accessor}]", "NaN or huge numbers", "metres")
    return points


def _faces(
    source: GltfFile, primitive: PrimitiveModel, count: int, place: str
) -> Int64[np.ndarray, "faces 3"]:
    if primitive.indices is None:
        numbers = np.arange(count)
    else:
        numbers = _numbers(source, primitive.indices, ("SCALAR", _WHOLE), f"{place}.indices")[:, 0]
    if len(numbers) % 3:
        raise source.refusal(place, f"{len(numbers)} corners", "three for each triangle")
    if int(numbers.max()) >= count:
        found, expected = f"vertex {int(numbers.max())}", f"vertices below {count}"
        raise source.refusal(f"{place}.indices", found, expected)
    return numbers.reshape(-1, 3).astype(np.int64)


def _numbers(
    source: GltfFile, index: int, wanted: tuple[str, tuple[int, ...]], field: str
) -> Shaped[np.ndarray, "rows columns"]:
    """Return the numbers of an accessor; nothing is allocated that the file does not hold."""
    gltf = source.gltf
    accessor = source.item(gltf.accessors, index, field)
    place = f"$.accessors[{index}]"
    kind, component_types = wanted
    if accessor.type != kind or accessor.componentType not in component_types:
        expected = f"{kind} of {' or '.join(map(str, component_types))}"
        found = f"{accessor.type[:20]} of {accessor.componentType}"
        raise source.refusal(place, found, expected)
    if accessor.bufferView is None or accessor.sparse is not None or accessor.normalized:
        expected = "plain numbers in a bufferView, neither sparse nor normalized"
        raise source.refusal(place, "something else", expected)
    view = source.item(gltf.bufferViews, accessor.bufferView, f"{place}.bufferView")
    buffer = source.item(gltf.buffers, view.buffer, f"$.bufferViews[{accessor.bufferView}].buffer")
    if view.buffer != 0 or buffer.uri is not None:
        found, expected = "a buffer in another file", "the file's own binary chunk"
        raise source.refusal(f"$.buffers[{view.buffer}]", found, expected)
    dtype, columns = np.dtype(_TYPES[accessor.componentType]), _COLUMNS[kind]
    row = dtype.itemsize * columns
    stride = view.byteStride or row
    needed = accessor.byteOffset + stride * (accessor.count - 1) + row
    held = min(view.byteLength, len(source.binary) - view.byteOffset)
    if stride < row or needed > held:
        expected = f"at most the {max(held, 0)} bytes of its bufferView"
        raise source.refusal(place, f"{accessor.count} times {stride} bytes", expected)
    start = view.byteOffset + accessor.byteOffset
    shape, strides = (accessor.count, columns), (stride, dtype.itemsize)
    return np.ndarray(shape, dtype, source.binary, start, strides).copy()
