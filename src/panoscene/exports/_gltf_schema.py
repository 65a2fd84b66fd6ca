"""The part of glTF 2.0 that is read: its fields, their types and their limits."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from panoscene.scene import Problem, SceneFormatError

T = TypeVar("T")

MAX_ITEMS = 100_000
"""More nodes, meshes or accessors than this are refused."""

Index = Annotated[int, Field(ge=0, le=2**31)]
Count = Annotated[int, Field(ge=0, le=2**31)]
Number = Annotated[float, Field(ge=-1e9, le=1e9)]
"""A number that survives in float32 and does not overflow when transforms are chained."""


class Part(BaseModel):
    """Settings of every part: what is not needed here is ignored, as glTF asks of readers."""

    model_config = ConfigDict(frozen=True, extra="ignore", strict=True, allow_inf_nan=False)


class SceneModel(Part):
    """A scene: the nodes at the top."""

    nodes: Annotated[list[Index], Field(max_length=MAX_ITEMS)] = []
    extras: Any = None


class NodeModel(Part):
    """A node: where it is, what hangs below it."""

    name: str | None = None
    children: Annotated[list[Index], Field(max_length=MAX_ITEMS)] = []
    mesh: Index | None = None
    matrix: Annotated[list[Number], Field(min_length=16, max_length=16)] | None = None
    translation: Annotated[list[Number], Field(min_length=3, max_length=3)] = [0.0, 0.0, 0.0]
    rotation: Annotated[list[Number], Field(min_length=4, max_length=4)] = [0.0, 0.0, 0.0, 1.0]
    scale: Annotated[list[Number], Field(min_length=3, max_length=3)] = [1.0, 1.0, 1.0]
    extras: Any = None


class PrimitiveModel(Part):
    """Triangles of one material."""

    attributes: dict[str, Index]
    indices: Index | None = None
    mode: Index = 4


class MeshModel(Part):
    """A mesh: one or several primitives."""

    primitives: Annotated[list[PrimitiveModel], Field(min_length=1, max_length=256)]


class AccessorModel(Part):
    """An array of numbers in a buffer view."""

    bufferView: Index | None = None  # noqa: N815
    byteOffset: Count = 0  # noqa: N815
    componentType: Literal[5120, 5121, 5122, 5123, 5125, 5126]  # noqa: N815
    normalized: bool = False
    count: Annotated[int, Field(ge=1, le=2**31)]
    type: str
    sparse: Any = None


class BufferViewModel(Part):
    """A part of a buffer."""

    buffer: Index
    byteOffset: Count = 0  # noqa: N815
    byteLength: Annotated[int, Field(ge=1, le=2**31)]  # noqa: N815
    byteStride: Annotated[int, Field(ge=4, le=252)] | None = None  # noqa: N815


class BufferModel(Part):
    """A block of bytes: the binary chunk, unless it names a file."""

    uri: str | None = None
    byteLength: Annotated[int, Field(ge=1, le=2**31)]  # noqa: N815


class AssetModel(Part):
    """The version of glTF."""

    version: Annotated[str, Field(pattern=r"^2\.\d+$")]


class GltfModel(Part):
    """A glTF document."""

    asset: AssetModel
    scene: Index = 0
    scenes: Annotated[list[SceneModel], Field(min_length=1, max_length=1000)]
    nodes: Annotated[list[NodeModel], Field(max_length=MAX_ITEMS)] = []
    meshes: Annotated[list[MeshModel], Field(max_length=MAX_ITEMS)] = []
    accessors: Annotated[list[AccessorModel], Field(max_length=MAX_ITEMS)] = []
    bufferViews: Annotated[list[BufferViewModel], Field(max_length=MAX_ITEMS)] = []  # noqa: N815
    buffers: Annotated[list[BufferModel], Field(max_length=1000)] = []
    extensionsRequired: Annotated[list[str], Field(max_length=100)] = []  # noqa: N815


@dataclass(frozen=True, slots=True)
class GltfFile:
    """A checked glTF document, its binary chunk, and the name of the file for error messages."""

    file: str
    gltf: GltfModel
    binary: bytes

    def item(self, items: list[T], index: int, field: str) -> T:
        """Return an item of a list of the document.

        Raises:
            SceneFormatError: There is no such item.
        """
        if index >= len(items):
            expected = f"an index below {len(items)}"
            raise self.refusal(field, str(index), expected)
        return items[index]

    def refusal(self, field: str, found: str, expected: str) -> SceneFormatError:
        """Return the error to raise about a field."""
        return SceneFormatError(self.file, [Problem(field, found, expected)])


def gltf_file(document: object, binary: bytes, file: str) -> GltfFile:
    """Return the parts of a GLB file, the document checked.

    Raises:
        SceneFormatError: A field that is needed is missing or not what glTF says; all are listed.
    """
    try:
        model = GltfModel.model_validate(document)
    except ValidationError as error:
        raise SceneFormatError(file, [_problem(detail) for detail in error.errors()]) from None
    source = GltfFile(file, model, binary)
    needed = [name for name in model.extensionsRequired if name != "KHR_materials_unlit"]
    if needed:
        found, expected = ", ".join(needed)[:100], "none: export without compression"
        raise source.refusal("$.extensionsRequired", found, expected)
    return source


def _problem(detail: Any) -> Problem:
    place = "".join(f"[{p}]" if isinstance(p, int) else f".{p[:60]}" for p in detail["loc"])
    if detail["type"] == "missing":
        return Problem(f"${place}", "nothing", "a value: glTF requires this field")
    return Problem(
        f"${place}", quoted(detail["input"]), detail["msg"].removeprefix("Input should be ")
    )


def quoted(value: object) -> str:
    """Return a value as it is quoted in an error message: short, on one line."""
    if isinstance(value, dict | list):
        return f"{'an object' if isinstance(value, dict) else 'a list'} of {len(value)}"
    if isinstance(value, int) and value.bit_length() > 200:
        return "a number of many digits"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
