"""Batches of any shape, moved to a device."""

import dataclasses
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor


class Batch:
    """A batch that wrappers of modules hand on as it is, for they do not know this class."""

    def __init__(self, content: Any) -> None:
        self.content = content


def on_device(batch: Any, device: torch.device) -> Any:
    """Return a batch with all its tensors on a device: in tuples, lists, dicts and dataclasses.

    Whatever else there is stays as it is.

    Examples:
        >>> on_device({"image": torch.zeros(1), "names": ["a"]}, torch.device("cpu"))
        {'image': tensor([0.]), 'names': ['a']}
    """
    if isinstance(batch, Tensor):
        return batch.to(device, non_blocking=True)
    if isinstance(batch, Mapping):
        return {key: on_device(value, device) for key, value in batch.items()}
    if isinstance(batch, tuple) and hasattr(batch, "_fields"):
        return type(batch)(*(on_device(value, device) for value in batch))
    if isinstance(batch, list | tuple):
        return type(batch)(on_device(value, device) for value in batch)
    if dataclasses.is_dataclass(batch) and not isinstance(batch, type):
        changes = {
            field.name: on_device(getattr(batch, field.name), device)
            for field in dataclasses.fields(batch)
            if field.init
        }
        return dataclasses.replace(batch, **changes)
    return batch
