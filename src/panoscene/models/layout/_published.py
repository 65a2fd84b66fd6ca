"""Weights of HorizonNet as its authors published them, for our network of the paper's edition."""

import re
from collections.abc import Mapping
from pathlib import Path

import torch
from torch import Tensor

from panoscene.models._errors import CheckpointError
from panoscene.models._imagenet import check_tensor, read_tensors
from panoscene.models.layout._network import LayoutNetwork

_RULES = (
    # a convolution that pads is the second member of a pair there: circular padding, convolution
    (r"^feature_extractor\.encoder\.", "backbone.network."),
    (r"^reduce_height_module\.ghc_lst\.(\d+)\.layer\.(\d+)\.layers\.", r"compress.\1.halve.\2."),
    (r"^bi_rnn\.", "recurrent."),
    (r"^linear\.", "head."),
)


def read_published_layout(path: Path, network: LayoutNetwork) -> None:
    """Fill a layout network with weights that HorizonNet's authors published.

    Only tensors are read; no code in the file is run. The signs of both boundaries are changed:
    HorizonNet counts latitude downwards.

    Args:
        path: A .pth file with the authors' names, plain or under the key ``state_dict``.
        network: Of the paper's edition, or another of that shape (resnet18, resnet34).

    Raises:
        CheckpointError: The file cannot be read, holds more than tensors, or does not fit.
    """
    given = published_names(read_tensors(path))
    wanted = network.state_dict()
    missing = [name for name in wanted if name not in given and "num_batches" not in name]
    if missing:
        found = f"no tensor for {missing[0]} ({len(missing)} missing)"
        raise CheckpointError(path, found, "weights of HorizonNet as published")
    unknown = [name for name in given if name not in wanted]
    if unknown:
        found = f"{unknown[0]} and {len(unknown) - 1} more" if unknown[1:] else unknown[0]
        raise CheckpointError(path, found, "only tensors that the network has")
    for name, tensor in given.items():
        check_tensor(path, name, tensor, wanted[name], of="HorizonNet")
    for name in ("head.weight", "head.bias"):
        given[name] = _upwards(given[name], network.columns)
    network.load_state_dict({**wanted, **given})


def published_names(tensors: Mapping[str, Tensor]) -> dict[str, Tensor]:
    """Return tensors of a published file under the names that they have in our network.

    Examples:
        >>> name = "reduce_height_module.ghc_lst.3.layer.0.layers.0.1.weight"
        >>> list(published_names({name: torch.zeros(1)}))
        ['compress.3.halve.0.0.weight']
    """
    return {_our_name(name): tensor for name, tensor in tensors.items()}


def _our_name(name: str) -> str:
    for pattern, ours in _RULES:
        name = re.sub(pattern, ours, name)
    name = re.sub(r"^(compress\.\d+\.halve\.\d+\.0)\.1\.", r"\1.", name)
    # conv1, conv2 and conv3 of the backbone; downsample.1 is a norm and keeps its number
    return re.sub(r"(\bconv\d)\.1\.", r"\1.", name)


def _upwards(rows: Tensor, columns: int) -> Tensor:
    """Return the rows of the last layer with those of the boundaries negated."""
    sign = torch.tensor([1.0, -1.0, -1.0]).repeat_interleave(columns)
    return rows * sign.reshape(-1, *[1] * (rows.ndim - 1))
