"""Assembling a glTF document: accessors, meshes, materials and pictures in one buffer."""

from typing import Any

import numpy as np
from jaxtyping import Float, Int

_FLOAT, _UINT16, _UINT32 = 5126, 5123, 5125
_VERTEX_BUFFER, _INDEX_BUFFER = 34962, 34963
_LINEAR, _LINEAR_MIPMAP_LINEAR, _CLAMP = 9729, 9987, 33071

UNLIT = "KHR_materials_unlit"
"""The extension for pictures that carry their own light."""


class GltfBuilder:
    """A glTF document that grows; everything refers to what was added before by its index."""

    def __init__(self) -> None:
        self.document: dict[str, Any] = {"asset": {"version": "2.0", "generator": "panoscene"}}
        self._binary = bytearray()
        self._materials: dict[str, int] = {}

    def add(self, kind: str, item: dict[str, Any]) -> int:
        """Append an item to a list of the document, such as ``nodes``, and return its index."""
        items = self.document.setdefault(kind, [])
        items.append(item)
        return len(items) - 1

    def add_mesh(
        self,
        name: str,
        vertices: Float[np.ndarray, "vertices 3"],
        faces: Int[np.ndarray, "faces 3"],
        material: int,
        *,
        normals: Float[np.ndarray, "vertices 3"] | None = None,
        texture_uv: Float[np.ndarray, "vertices 2"] | None = None,
    ) -> int:
        """Append a mesh in glTF axes and return its index; without normals it is drawn faceted."""
        attributes = {"POSITION": self._floats(vertices, "VEC3", bounds=True)}
        if normals is not None:
            attributes["NORMAL"] = self._floats(normals, "VEC3")
        if texture_uv is not None:
            attributes["TEXCOORD_0"] = self._floats(texture_uv, "VEC2")
        primitive = {
            "attributes": attributes,
            "indices": self._indices(faces, len(vertices)),
            "material": material,
        }
        return self.add("meshes", {"name": name, "primitives": [primitive]})

    def add_colour(self, name: str, colour: str) -> int:
        """Return the index of a matt material of an sRGB colour such as ``#4b525c``.

        It is appended when no material has the name yet.
        """
        if name not in self._materials:
            surface = {
                "baseColorFactor": [*linear_colour(colour), 1.0],
                "metallicFactor": 0.0,
                "roughnessFactor": 0.9,
            }
            material = {"name": name, "pbrMetallicRoughness": surface}
            self._materials[name] = self.add("materials", material)
        return self._materials[name]

    def add_picture(self, name: str, jpeg: bytes) -> int:
        """Append a material that shows a JPEG as it is, without lights, and return its index."""
        if "samplers" not in self.document:
            clamped = {"wrapS": _CLAMP, "wrapT": _CLAMP}
            smooth = {"magFilter": _LINEAR, "minFilter": _LINEAR_MIPMAP_LINEAR}
            self.add("samplers", smooth | clamped)
            self.document["extensionsUsed"] = [UNLIT]
        view = {"bufferView": self._view(jpeg), "mimeType": "image/jpeg", "name": name}
        texture = self.add("textures", {"source": self.add("images", view), "sampler": 0})
        surface = {
            "baseColorTexture": {"index": texture},
            "metallicFactor": 0.0,
            "roughnessFactor": 0.9,
        }
        material = {"name": name, "pbrMetallicRoughness": surface, "extensions": {UNLIT: {}}}
        return self.add("materials", material)

    def finish(self) -> tuple[dict[str, Any], bytes]:
        """Return the document and its buffer."""
        if self._binary:
            self.document["buffers"] = [{"byteLength": len(self._binary)}]
        return self.document, bytes(self._binary)

    def _view(self, data: bytes, target: int | None = None) -> int:
        view = {"buffer": 0, "byteOffset": len(self._binary), "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        self._binary += data + b"\0" * (-len(data) % 4)
        return self.add("bufferViews", view)

    def _floats(
        self, values: Float[np.ndarray, "rows columns"], kind: str, *, bounds: bool = False
    ) -> int:
        values = values.astype("<f4")
        accessor = {
            "bufferView": self._view(values.tobytes(), _VERTEX_BUFFER),
            "componentType": _FLOAT,
            "count": len(values),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
        return self.add("accessors", accessor)

    def _indices(self, faces: Int[np.ndarray, "faces 3"], vertices: int) -> int:
        small = vertices < 2**16 - 1  # the largest number is reserved
        data = faces.astype("<u2" if small else "<u4").tobytes()
        accessor = {
            "bufferView": self._view(data, _INDEX_BUFFER),
            "componentType": _UINT16 if small else _UINT32,
            "count": faces.size,
            "type": "SCALAR",
        }
        return self.add("accessors", accessor)


def linear_colour(colour: str) -> list[float]:
    """Return red, green and blue of an sRGB colour such as ``#4b525c`` in linear light.

    Examples:
        >>> linear_colour("#ff0080")
        [1.0, 0.0, 0.2158605]
    """
    encoded = np.frombuffer(bytes.fromhex(colour[1:]), dtype=np.uint8) / 255
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    return linear.round(7).tolist()
