"""Records of tensors, moved to a device."""

from dataclasses import fields, is_dataclass, replace
from typing import TypeVar

import torch
from torch import Tensor

Record = TypeVar("Record")


def moved(record: Record, device: torch.device | str) -> Record:
    """Return a record of tensors, and of records of tensors, on a device."""
    if not is_dataclass(record) or isinstance(record, type):
        return record
    changed = {}
    for field in fields(record):
        value = getattr(record, field.name)
        changed[field.name] = (
            value.to(device) if isinstance(value, Tensor) else moved(value, device)
        )
    return replace(record, **changed)
