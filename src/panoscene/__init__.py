"""Total 3D scene understanding from one 360-degree indoor photo."""

from importlib import import_module
from typing import Any

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    # PyTorch takes seconds to import: only who loads a pipeline waits for it
    if name == "load":
        return import_module("panoscene.pipeline").load
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
