"""What a measurement ran on."""

import os
import platform
from pathlib import Path

import numpy as np
import torch

from panoscene import __version__


def machine_facts() -> dict[str, str | int]:
    """Return processor, cores, threads and versions, to be kept with every measurement."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count() or 0,
        "torch_threads": torch.get_num_threads(),
        "python": platform.python_version(),
        "torch": torch.__version__,
        "numpy": np.__version__,
        "panoscene": __version__,
    }


def _processor() -> str:
    """Return the processor's name where the system tells it."""
    listing = Path("/proc/cpuinfo")
    if listing.is_file():
        for line in listing.read_text().splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
