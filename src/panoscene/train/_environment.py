"""What a training ran on, for whoever wants to repeat it."""

import hashlib
import importlib.metadata
import platform
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import torch

import panoscene

_PACKAGES = ("torch", "torchvision", "timm", "lightning-fabric", "numpy", "safetensors", "pillow")
_INDEX = "dataset.json"


def environment(*, precision: str, device: str, devices: int, data: Path | None) -> dict[str, Any]:
    """Return versions, machine, threads and data of a training that starts now."""
    return {
        "panoscene": panoscene.__version__,
        "git": git_commit(Path(panoscene.__file__).parent),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in _PACKAGES},
        "platform": platform.platform(),
        "processor": _processor(),
        "gpus": [torch.cuda.get_device_name(k) for k in range(torch.cuda.device_count())],
        "device": device,
        "devices": devices,
        "precision": precision,
        "threads": torch.get_num_threads(),
        "data": None if data is None else str(data),
        "data_hash": data_hash(data),
        "command": sys.argv,
    }


def data_hash(data: Path | None) -> str:
    """Return the SHA-256 of a set's dataset.json; empty without one."""
    if data is None or not (data / _INDEX).is_file():
        return ""
    return hashlib.sha256((data / _INDEX).read_bytes()).hexdigest()


def git_commit(folder: Path) -> str | None:
    """Return the commit of a folder, with ``+changes`` if files differ; None without git."""
    try:
        commit = _git(folder, "rev-parse", "HEAD")
        changed = _git(folder, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return None
    return commit + ("+changes" if changed else "")


def _git(folder: Path, *words: str) -> str:
    command = ["git", "-C", str(folder), *words]
    result = subprocess.run(command, check=True, capture_output=True, text=True, timeout=30)  # noqa: S603
    return result.stdout.strip()


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    file = Path("/proc/cpuinfo")
    if file.is_file():
        for line in file.read_text(errors="ignore").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor()
