"""Files with weights: safetensors that say what they are for."""

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, NamedTuple, TypeVar

import torch
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from torch import Tensor, nn
from torch.nn import init
from torch.overrides import TorchFunctionMode

from panoscene._editions import Edition
from panoscene.scene import write_atomically

from ._errors import CheckpointError

SCHEMA = 1
"""Version of the header."""
_KEY, _HASH = "panoscene", "sha256"
_LISTED = 3
_FOLDER = Path(__file__).parent / "weights"
_RANDOM = frozenset(
    {Tensor.normal_, Tensor.uniform_, init.normal_, init.uniform_, init.kaiming_uniform_}
)
Config = TypeVar("Config", bound=BaseModel)
Network = TypeVar("Network", bound=nn.Module)


class WeightsHeader(BaseModel):
    """What a file with weights is for and where it comes from."""

    model_config = ConfigDict(frozen=True, extra="forbid", populate_by_name=True)

    schema_version: Annotated[int, Field(alias="schema")] = SCHEMA
    stage: str
    """detector, layout, pose, shape or context."""
    edition: Edition
    config: dict[str, Any] = {}
    """What the network was built from."""
    metrics: dict[str, float] = {}
    """On the validation part, when it was saved."""
    recipe: dict[str, Any] = {}
    """What it was trained with."""
    data_hash: str = ""
    """Of the index of the data set; empty where there was none."""
    seed: int = 0
    created_by: str = ""
    """Name and version of the program."""


def write_weights(
    path: Path, module: nn.Module, header: WeightsHeader, *, half: bool = True
) -> None:
    """Write all parameters and buffers of a module, with a header, in one step.

    Args:
        path: A .safetensors file.
        module: The network.
        header: What it is.
        half: Whether matrices and kernels are stored with 16 bits; vectors (biases, statistics)
            keep 32, for they are few and have large ranges.

    Raises:
        ValueError: A value is not finite, also as 16 bits.
    """
    from safetensors.torch import save  # noqa: PLC0415

    tensors = {}
    for name, tensor in module.state_dict().items():
        stored = tensor.detach().to("cpu").clone(memory_format=torch.contiguous_format)
        if half and stored.is_floating_point() and stored.dim() > 1:
            stored = stored.half()
        if stored.is_floating_point() and not bool(stored.isfinite().all()):
            raise ValueError(f"module: found values in {name} that are not finite")
        tensors[name] = stored
    text = header.model_dump_json(by_alias=True)
    write_atomically(path, save(tensors, {_KEY: text, _HASH: content_hash(tensors)}))


def read_weights(path: Path, module: nn.Module, *, stage: str, edition: Edition) -> WeightsHeader:
    """Fill a module with the weights in a file and return the file's header.

    Everything is checked before anything is changed: stage, edition, every name and shape, and
    the hash of the content.

    Args:
        path: Written by ``write_weights``.
        module: The network, built as the file's header says.
        stage: What the file must be for.
        edition: Likewise.

    Raises:
        CheckpointError: The file is missing, damaged, or for another network.
    """
    file = _read(path)
    _check_purpose(path, file.header, stage, edition)
    _fill(module, file, path)
    return file.header


def load_network(
    path: Path,
    build: Callable[[Config], Network],
    default: Config,
    *,
    stage: str,
    edition: Edition,
) -> Network:
    """Return the network in a file with weights.

    It is built as the file says, without the random weights that it would start a training with.

    Args:
        path: Written by ``write_weights``.
        build: Makes a network.
        default: What to make it from where the file says nothing.
        stage: What the file must be for.
        edition: Likewise.

    Raises:
        CheckpointError: The file is missing, damaged, for another network, or says what no
            network of the stage can be built from.
    """
    file = _read(path)
    _check_purpose(path, file.header, stage, edition)
    config = _config(path, file.header, default)
    with _Unfilled():
        network = build(config)
    _fill(network, file, path)
    return network


class _Unfilled(TorchFunctionMode):
    """Where random numbers are not written into tensors, in this thread: it takes longest."""

    def __torch_function__(
        self, func: Any, types: Any, args: tuple[Any, ...] = (), kwargs: Any = None
    ) -> Any:
        kwargs = kwargs or {}
        if func in _RANDOM:
            return args[0] if args else kwargs["tensor"]
        return func(*args, **kwargs)


def _fill(module: nn.Module, file: "_File", path: Path) -> None:
    """Fill a module with the tensors of a file; everything is checked before."""
    tensors, header = file.tensors, file.header
    wanted = module.state_dict()
    _check_names(path, tensors, wanted)
    for name, tensor in wanted.items():
        if tensors[name].shape != tensor.shape:
            found = f"{name} of shape {_shape(tensors[name])}"
            expected = f"{_shape(tensor)}, as the {header.edition} {header.stage} has"
            raise CheckpointError(path, found, expected)
    if content_hash(tensors) != file.digest:
        raise CheckpointError(path, "tensors that do not match their hash", "an undamaged file")
    module.load_state_dict(tensors)


def read_weights_header(path: Path) -> WeightsHeader:
    """Return what a file with weights says about itself.

    Raises:
        CheckpointError: The file is missing, or is no file with weights.
    """
    return _read(path).header


def _config(path: Path, header: WeightsHeader, default: Config) -> Config:
    """Return what the network in a file was built from."""
    if not header.config:
        return default
    try:
        return type(default).model_validate(header.config)
    except ValidationError as error:
        names = [".".join(map(str, fault["loc"])) or "all" for fault in error.errors()]
        found = f"a configuration with faults in {_listed(names)}"
        expected = f"that of the {header.edition} {header.stage}"
        raise CheckpointError(path, found, expected) from None


def shipped_weights(stage: str) -> Path:
    """Return the file with the compact weights of a stage that comes with this package.

    Raises:
        CheckpointError: There is none.
    """
    path = _FOLDER / f"{stage}-compact.safetensors"
    if not path.is_file():
        raise CheckpointError(
            path, "no such file", f"the compact weights of the {stage}; train them, or name a file"
        )
    return path


def weights_file(stage: str, edition: Edition, weights: Path | None) -> Path:
    """Return the file with the weights of a stage: the given one, or that of the package.

    Args:
        stage: Such as ``pose``.
        edition: Which network; weights come with the compact one only.
        weights: A .safetensors file; None for that of the package.

    Raises:
        CheckpointError: There is none in the package.
    """
    if weights is not None:
        return weights
    if edition != "compact":
        raise CheckpointError(
            f"{stage}-{edition}.safetensors", "no file named",
            f"a file with weights: none come with the {edition} edition",
        )  # fmt: skip
    return shipped_weights(stage)


def content_hash(tensors: Mapping[str, Tensor]) -> str:
    """Return the SHA-256 of names, types, shapes and values of tensors, whatever their order.

    Examples:
        >>> a, b = torch.zeros(2), torch.ones(1)
        >>> content_hash({"a": a, "b": b}) == content_hash({"b": b, "a": a})
        True
    """
    digest = hashlib.sha256()
    for name in sorted(tensors):
        tensor = tensors[name].detach().cpu().contiguous()
        digest.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}\n".encode())
        digest.update(tensor.reshape(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()


class _File(NamedTuple):
    header: WeightsHeader
    tensors: dict[str, Tensor]
    digest: str


def _read(path: Path) -> _File:
    from safetensors import SafetensorError, safe_open  # noqa: PLC0415

    expected = "a .safetensors file with weights of panoscene"
    try:
        with safe_open(path, framework="pt", device="cpu") as file:
            metadata = file.metadata() or {}
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    except OSError as error:
        reason = error.strerror or " ".join(str(error).split())
        raise CheckpointError(path, f"no readable file ({reason})", expected) from None
    except SafetensorError as error:
        raise CheckpointError(path, " ".join(str(error).split()), expected) from None
    if _KEY not in metadata:
        raise CheckpointError(path, "no header", expected)
    try:
        document = json.loads(metadata[_KEY])
        version = document.get("schema") if isinstance(document, dict) else None
        if version != SCHEMA:
            found = f"a header of schema {version}"
            raise CheckpointError(path, found, f"schema {SCHEMA}: another version wrote this file")
        header = WeightsHeader.model_validate(document)
        return _File(header, tensors, metadata.get(_HASH, ""))
    except (ValidationError, json.JSONDecodeError) as error:
        raise CheckpointError(path, " ".join(str(error).split())[:200], expected) from None


def _check_purpose(path: Path, header: WeightsHeader, stage: str, edition: Edition) -> None:
    if (header.stage, header.edition) != (stage, edition):
        found = f"weights of the {header.edition} {header.stage}"
        raise CheckpointError(path, found, f"those of the {edition} {stage}")


def _check_names(path: Path, given: Mapping[str, Tensor], wanted: Mapping[str, Tensor]) -> None:
    missing = [name for name in wanted if name not in given]
    if missing:
        raise CheckpointError(path, f"no {_listed(missing)}", "every tensor of the network")
    unknown = [name for name in given if name not in wanted]
    if unknown:
        raise CheckpointError(path, _listed(unknown), "only tensors that the network has")


def _listed(names: list[str]) -> str:
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")


def _shape(tensor: Tensor) -> str:
    return " x ".join(map(str, tensor.shape)) or "a single number"
